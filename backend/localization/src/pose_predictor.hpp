// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <optional>

#include "hybrid_slam/localization/localizer.hpp"
#include "hybrid_slam/odometry/visual_track.hpp"

namespace hybrid_slam {

/// Poses between scans, by visual odometry.
class PosePredictor {
  public:
    explicit PosePredictor(const MotionPriorConfig& config) : config_(config) {}

    /// What was seen; what is known already is left out.
    void see(const VisualMotion& motion);
    /// The pose at a scan.
    void anchor(const PredictedPose& pose);
    /// The place is not known any more.
    void forget();

    /// From the newest scan that is not younger than `stamp`.
    std::optional<PredictedPose> at(double stamp) const;

  private:
    MotionPriorConfig config_;
    VisualTrack track_;
    std::deque<PredictedPose> poses_;  ///< at the newest scans, in order
};

}  // namespace hybrid_slam
