// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "hybrid_slam/core/measurements.hpp"

namespace hybrid_slam {

/// One scan with what came along with it: the unit that SLAM processes.
struct Frame {
    Scan scan;
    std::optional<Pose2d> odom_from_robot;  ///< wheel odometry at the stamp of the scan
    std::vector<Image> images;  ///< those since the frame before, the newest kMostImages
};

/// Groups a stream of measurements into frames, one for each scan, in the order of the stream
/// (never sorted by stamp: the clocks of real logs run backwards).
class FrameAssembler {
  public:
    /// Returns a frame when the measurement completes one. Wheel odometry at the stamp of the scan
    /// is the reading with that very stamp, else what the newest two give by inter- or
    /// extrapolation, when one of them is within kMaxExtrapolation (and ten times their interval),
    /// else none.
    std::optional<Frame> push(Measurement measurement);

    static constexpr double kMaxExtrapolation = 0.5;  ///< seconds
    /// While no scan comes, the newest so many images are kept.
    static constexpr std::size_t kMostImages = 100;

  private:
    std::optional<Pose2d> odometry_at(double stamp) const;

    std::optional<WheelOdometry> newest_;
    std::optional<WheelOdometry> before_newest_;
    std::deque<Image> images_;
};

}  // namespace hybrid_slam
