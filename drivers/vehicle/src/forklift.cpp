// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vehicle/forklift.hpp"

#include <algorithm>
#include <cmath>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

/// From `value` towards `wanted` by at most `most`.
double approach(double value, double wanted, double most) {
    return value + std::clamp(wanted - value, -most, most);
}

}  // namespace

void describe(ConfigSchema& schema, VehicleConfig& config) {
    schema.add("wheelbase", config.wheelbase, -20.0, 20.0,
               "m from the fixed axle to the steered wheel; negative: it is behind");
    schema.add_degrees("steering_limit_deg", config.steering_limit, 1.0, 89.0, "deg, to each side");
    schema.add_degrees("steering_rate_deg", config.steering_rate, 1.0, 1000.0, "deg per second");
    schema.add("speed_limit", config.speed_limit, 0.01, 10.0, "m/s of the fixed axle");
    schema.add("acceleration", config.acceleration, 0.01, 20.0, "m/s^2, braking too");
    schema.add("footprint_front", config.footprint_front, 0.0, 20.0, "m ahead of the origin");
    schema.add("footprint_rear", config.footprint_rear, 0.0, 20.0, "m behind the origin");
    schema.add("footprint_width", config.footprint_width, 0.0, 20.0, "m");
}

const VehicleConfig& steerable(const VehicleConfig& config) {
    constexpr double kLeastWheelbase = 0.1;  // metres, to either side
    if (!(std::abs(config.wheelbase) >= kLeastWheelbase)) {
        throw Error("vehicle.wheelbase: too short to steer by");
    }
    return config;
}

/// Bicycle model: the normals of both wheels meet in the centre of the turn.
Eigen::Vector3d VehicleState::twist(const VehicleConfig& config) const {
    return {speed, 0.0, speed * std::tan(steering) / config.wheelbase};
}

VehicleState step(const VehicleConfig& config, const VehicleState& state,
                  const DriveCommand& command, double seconds) {
    const double speed = std::clamp(command.speed, -config.speed_limit, config.speed_limit);
    const double steering =
        std::clamp(command.steering, -config.steering_limit, config.steering_limit);
    VehicleState after = state;
    after.speed = approach(state.speed, speed, config.acceleration * seconds);
    after.steering = approach(state.steering, steering, config.steering_rate * seconds);
    VehicleState mean = state;
    mean.speed = (state.speed + after.speed) / 2.0;
    mean.steering = (state.steering + after.steering) / 2.0;
    after.world_from_robot = state.world_from_robot * Pose2d::exp(seconds * mean.twist(config));
    return after;
}

double steering_for(const VehicleConfig& config, double curvature) {
    const double steering = std::atan(config.wheelbase * curvature);
    return std::clamp(steering, -config.steering_limit, config.steering_limit);
}

}  // namespace hybrid_slam
