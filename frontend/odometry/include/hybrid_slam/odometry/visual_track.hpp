// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <optional>

#include "hybrid_slam/core/measurements.hpp"

namespace hybrid_slam {

/// The way of the robot by visual odometry, for as long as somebody asks about it.
class VisualTrack {
  public:
    /// In the order of the images. One that does not follow on the one before leaves a gap.
    void add(const VisualMotion& motion);

    struct Motion {
        Pose2d from_from_to;
        Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of from_from_to: m2, m rad, rad2
        Eigen::Vector3d twist = Eigen::Vector3d::Zero();       ///< at the end: m/s, m/s, rad/s
    };

    /// The motion between two stamps: interpolated between images, and carried on from the newest
    /// one for up to `most_extrapolation` seconds, at the cost of certainty. Empty when any of the
    /// way between was not seen.
    std::optional<Motion> between(double from, double to, double most_extrapolation) const;

    /// What lies wholly before the stamp is asked for no more.
    void forget_before(double stamp);

    /// Stamp of the newest image, whether its motion is usable or not.
    std::optional<double> newest() const { return newest_; }

  private:
    std::optional<Motion> within(double from, double to) const;
    std::optional<Motion> speed_at(double stamp) const;

    std::deque<VisualMotion> motions_;
    std::optional<double> newest_;  ///< stamp, seconds; stays when its motion is forgotten
};

}  // namespace hybrid_slam
