// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "hybrid_slam/core/pose2.hpp"
#include "hybrid_slam/link/messages.hpp"

namespace hybrid_slam {

/// The master control says where the vehicle stands: a start for relocalization.
struct FleetInitialPose {
    Pose2d map_from_robot;
    std::string map;
};

/// What the master control wants. Of LinkCommand only kCancel, kPause and kResume; goals carry
/// orderId:orderUpdateId as id, which LinkStatus::goals gives back.
using FleetEvent = std::variant<LinkGoals, LinkCommand, FleetInitialPose>;

/// What the drive tells; once in each of its cycles.
struct FleetStatus {
    LinkStatus drive;
    std::optional<LinkPose> pose;   ///< the latest from SLAM, known or not
    std::optional<double> battery;  ///< percent; nothing: not measured
    bool is_charging = false;
    bool is_paused = false;          ///< whatever LinkStatus::state says; kPaused counts too
    bool is_protective = false;      ///< the scanner's protective field is broken
    bool is_emergency_stop = false;  ///< must be acknowledged at the vehicle
};

/// What the factsheet tells of the vehicle. Metres, seconds, kg; robot frame.
struct FleetVehicle {
    std::string series = "hybrid-slam forklift";
    double wheelbase = 1.2;  ///< x of the steered wheel from the fixed axle; negative: behind it
    double speed_least = 0.02;
    double speed_most = 0.3;
    double acceleration = 0.3;
    double deceleration = 0.5;
    double length = 2.0;
    double width = 0.9;
    double height = 2.0;
    double load_mass = 0.0;                  ///< 0: no loads are handled
    std::vector<Eigen::Vector2d> footprint;  ///< corners; empty: not told
};

}  // namespace hybrid_slam
