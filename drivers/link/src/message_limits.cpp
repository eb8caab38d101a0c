// SPDX-License-Identifier: Apache-2.0
#include "message_limits.hpp"

#include <fmt/format.h>

#include <cmath>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr double kFarthest = 1e6;       // m
constexpr double kMostTurn = 1000.0;    // rad: what a counter of turns may give, still exact
constexpr double kLatestStamp = 1e12;   // s
constexpr double kMostAge = 1e6;        // s
constexpr double kMostVariance = 1e12;  // m^2, rad^2

/// Refuses what is not a number, too.
void check_range(const char* key, double value, double least, double most) {
    if (!(value >= least && value <= most)) {
        throw Error(fmt::format("{}: must be a number from {} to {}", key, least, most));
    }
}

void check_text(const char* key, const std::string& text) {
    if (text.size() > kMostText) {
        throw Error(fmt::format("{}: must have at most {} bytes", key, kMostText));
    }
}

void check_place(double x, double y) {
    check_range("x", x, -kFarthest, kFarthest);
    check_range("y", y, -kFarthest, kFarthest);
}

void check_heading(double heading) {
    check_range("heading", heading, -kMostTurn, kMostTurn);
}

void check_covariance(const Eigen::Matrix3d& covariance) {
    for (int row = 0; row < 3; ++row) {
        check_range("covariance", covariance(row, row), 0.0, kMostVariance);
        for (int column = 0; column < row; ++column) {
            // Rounding on the way may leave it a little beyond.
            const double most =
                std::sqrt(covariance(row, row) * covariance(column, column)) * (1.0 + 1e-6) + 1e-12;
            check_range("covariance", covariance(row, column), -most, most);
        }
    }
}

}  // namespace

void check(const LinkHello& hello) {
    check_text("token", hello.token);
    check_text("name", hello.name);
}

void check(const LinkPose& pose) {
    check_range("stamp", pose.stamp, -kLatestStamp, kLatestStamp);
    check_range("age", pose.age, 0.0, kMostAge);
    check_text("map", pose.map);
    check_range("score", pose.score, 0.0, 1.0);
    if (pose.is_known()) {
        check_place(pose.map_from_robot.x(), pose.map_from_robot.y());
        check_heading(pose.map_from_robot.heading);
        check_covariance(pose.covariance);
    }
    check_range("clear_ahead", pose.clear_ahead.value_or(0.0), 0.0, kFarthest);
    check_range("clear_behind", pose.clear_behind.value_or(0.0), 0.0, kFarthest);
}

void check(const LinkInitialPose& pose) {
    check_place(pose.map_from_robot.x(), pose.map_from_robot.y());
    check_heading(pose.map_from_robot.heading);
}

void check(const LinkGoals& goals) {
    if (goals.waypoints.empty() || goals.waypoints.size() > kMostWaypoints) {
        throw Error(fmt::format("waypoints: must be 1 to {}", kMostWaypoints));
    }
    for (const LinkWaypoint& waypoint : goals.waypoints) {
        check_place(waypoint.place.x(), waypoint.place.y());
        check_heading(waypoint.heading.value_or(0.0));
    }
    check_text("id", goals.id);
}

void check(const LinkStatus& status) {
    check_text("reason", status.reason);
    check_text("fault", status.fault);
    check_text("goals", status.goals);
    check_text("map", status.map);
    if (status.map_from_robot) {
        check_place(status.map_from_robot->x(), status.map_from_robot->y());
        check_heading(status.map_from_robot->heading);
    }
    check_range("pose_age", status.pose_age, 0.0, kLatestStamp);
    check_range("pose_stamp", status.pose_stamp, -kLatestStamp, kLatestStamp);
    check_range("speed", status.speed, -1000.0, 1000.0);
    check_range("steering", status.steering, -kMostTurn, kMostTurn);
    check_range("waypoints_left", status.waypoints_left, 0.0, 1e6);
    check_range("remaining", status.remaining, 0.0, kFarthest);
}

void normalize(LinkPose& pose) {
    pose.map_from_robot.heading = normalize_angle(pose.map_from_robot.heading);
}

void normalize(LinkGoals& goals) {
    for (LinkWaypoint& waypoint : goals.waypoints) {
        if (waypoint.heading) {
            waypoint.heading = normalize_angle(*waypoint.heading);
        }
    }
}

}  // namespace hybrid_slam
