// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {

/// A vehicle with a fixed axle and one steered wheel. The robot's origin is at the middle of the
/// fixed axle, x forward.
struct VehicleConfig {
    /// Metres from the fixed axle to the steered wheel; negative: it is behind.
    double wheelbase = 1.2;
    double steering_limit = radians(75.0);  ///< radians to each side
    double steering_rate = radians(60.0);   ///< radians per second
    double speed_limit = 1.5;               ///< m/s of the fixed axle
    double acceleration = 0.5;              ///< m/s^2, braking too
    double footprint_front = 1.5;           ///< metres ahead of the origin
    double footprint_rear = 1.1;            ///< metres behind it: the forks trail
    double footprint_width = 0.9;           ///< metres
};

/// Lists the keys without a section before them.
void describe(ConfigSchema& schema, VehicleConfig& config);

/// The same; throws Error when the wheelbase is too short to steer by.
const VehicleConfig& steerable(const VehicleConfig& config);

/// What is asked of the vehicle.
struct DriveCommand {
    double speed = 0.0;     ///< m/s of the fixed axle; negative is backwards
    double steering = 0.0;  ///< radians, positive turns the wheel to the left
};

struct VehicleState {
    Pose2d world_from_robot;
    double speed = 0.0;     ///< m/s
    double steering = 0.0;  ///< radians

    /// (m/s, m/s, rad/s) of the robot in its own frame.
    Eigen::Vector3d twist(const VehicleConfig& config) const;
};

/// The state after `seconds`: speed and steering go towards the command as fast as they may, the
/// robot goes along the arc of their mean. Exact for constant speed and steering.
VehicleState step(const VehicleConfig& config, const VehicleState& state,
                  const DriveCommand& command, double seconds);

/// The steering angle, within its limit, that makes the robot follow `curvature` (1/m, left
/// positive).
double steering_for(const VehicleConfig& config, double curvature);

}  // namespace hybrid_slam
