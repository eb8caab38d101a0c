// SPDX-License-Identifier: Apache-2.0
#include "pose_keeping.hpp"

#include <algorithm>
#include <cmath>

namespace hybrid_slam {
namespace {

constexpr double kMemory = 1.0;  ///< seconds

/// The motion of the last `age` seconds.
Pose2d motion_since(const std::vector<FollowerState::Motion>& recent, double age) {
    Pose2d then_from_now;
    for (auto motion = recent.rbegin(); motion != recent.rend() && age > 0.0; ++motion) {
        const double share = std::min(1.0, age / motion->seconds);
        then_from_now = Pose2d::exp(share * motion->before_from_after.log()) * then_from_now;
        age -= motion->seconds;
    }
    return then_from_now;
}

double told_or(const std::optional<double>& told, double otherwise) {
    return told && std::isfinite(*told) ? *told : otherwise;
}

void remember(std::vector<FollowerState::Motion>& recent, const FollowerState::Motion& motion) {
    recent.push_back(motion);
    double seconds = 0.0;
    auto oldest = recent.end();
    while (oldest != recent.begin() && seconds < kMemory) {
        --oldest;
        seconds += oldest->seconds;
    }
    recent.erase(recent.begin(), oldest);
}

void believe(const FollowerConfig& config, FollowerState& state, const PoseReading& reading) {
    if (!(reading.age <= kMemory) || !reading.map_from_robot.vector().allFinite()) {
        return;
    }
    const Pose2d now = reading.map_from_robot * motion_since(state.recent, reading.age);
    Pose2d& believed = state.vehicle.world_from_robot;
    const bool far_off = (now.translation - believed.translation).norm() > config.pose_jump ||
                         std::abs(normalize_angle(now.heading - believed.heading)) > radians(10.0);
    believed = state.has_pose && !far_off ? interpolate(believed, now, config.pose_trust) : now;
    state.has_pose = true;
}

}  // namespace

void keep_pose(const VehicleConfig& vehicle, const FollowerConfig& config, FollowerState& state,
               const FollowerInput& input) {
    const VehicleState before = state.vehicle;
    VehicleState after = step(vehicle, before, state.command, input.seconds);
    after.speed = told_or(input.speed, after.speed);
    after.steering = told_or(input.steering, after.steering);
    // As `step` does it, with what was told.
    VehicleState mean = before;
    mean.speed = (before.speed + after.speed) / 2.0;
    mean.steering = (before.steering + after.steering) / 2.0;
    const Pose2d motion = Pose2d::exp(input.seconds * mean.twist(vehicle));
    after.world_from_robot = before.world_from_robot * motion;
    state.vehicle = after;
    remember(state.recent, {input.seconds, motion});
    if (input.pose) {
        believe(config, state, *input.pose);
    }
}

}  // namespace hybrid_slam
