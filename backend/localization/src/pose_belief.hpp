// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {

/// Where the robot is held to be, with the covariance of (x, y, heading) in the axes of the map.
struct PoseBelief {
    Pose2d map_from_robot;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

}  // namespace hybrid_slam
