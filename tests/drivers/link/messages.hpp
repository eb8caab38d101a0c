// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid_slam/link/messages.hpp"

namespace hybrid_slam::test {

/// Each number is another one, so that swapped ones show.
inline LinkPose some_pose(double stamp = 12.5) {
    LinkPose pose;
    pose.stamp = stamp;
    pose.age = 0.07;
    pose.map = "hall";
    pose.status = LinkPoseStatus::kTracking;
    pose.map_from_robot = {1.25, -0.1, 3.0};
    pose.covariance << 4e-4, 1e-5, 2e-5, 1e-5, 9e-4, -3e-5, 2e-5, -3e-5, 1.6e-3;
    pose.score = 0.75;
    pose.clear_ahead = 2.5;
    pose.clear_behind = 0.3;
    pose.is_protective = false;
    return pose;
}

inline LinkGoals some_goals() {
    LinkGoals goals;
    goals.waypoints = {{{1.3, -0.15}, std::nullopt}, {{-2.4, -1.6}, 0.5}};
    goals.append = true;
    goals.id = "tour 7";
    return goals;
}

inline LinkStatus some_status() {
    LinkStatus status;
    status.mode = LinkMode::kAutomatic;
    status.state = LinkDriveState::kStopped;
    status.reason = "obstacle ahead";
    status.fault = "";
    status.goals = "tour 7";
    status.map = "hall";
    status.map_from_robot = Pose2d(1.3, -0.15, 0.1234);
    status.pose_age = 0.052;
    status.pose_stamp = 1712.25;
    status.speed = 0.25;
    status.steering = -0.125;
    status.waypoints_left = 2;
    status.remaining = 3.45;
    return status;
}

}  // namespace hybrid_slam::test
