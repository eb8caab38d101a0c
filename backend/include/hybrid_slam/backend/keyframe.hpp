// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hybrid_slam/registration/surface.hpp"

namespace hybrid_slam {

/// A scan that is kept: node i of the pose graph is keyframe i.
struct Keyframe {
    double stamp = 0.0;       ///< seconds
    double path = 0.0;        ///< metres driven up to here, by odometry
    Pose2d local_from_robot;  ///< by odometry alone
    Pose2d robot_from_laser;
    Surface surface;  ///< in the robot's frame
};

using Keyframes = std::vector<Keyframe>;

}  // namespace hybrid_slam
