// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/vehicle/forklift.hpp"
#include "hybrid_slam/vehicle/planner.hpp"

namespace hybrid_slam {

struct FollowerConfig {
    double speed_limit = 0.30;               ///< m/s
    double turn_rate_limit = radians(23.0);  ///< rad/s of the vehicle; slower where the way bends
    double braking = 0.15;                   ///< m/s^2 that is planned; the vehicle must do better
    double convergence = 0.4;                ///< metres; three of it leave a fifth of a deviation
    double steering_window = 0.2;           ///< metres over which a step of the curvature is spread
    double wheel_tolerance = radians(1.0);  ///< of the wheel before the vehicle starts
    double wheel_far = radians(20.0);       ///< of the wheel; more: stop and turn it
    double pose_trust = 0.25;               ///< share of a pose's difference that is believed
    double pose_jump = 0.3;                 ///< metres; a pose farther off is believed at once
    double off_path = 0.3;                  ///< metres beside the way that need another plan
    double arrival_tolerance = 0.03;        ///< metres, of the place where it stops in the end
    double obstacle_gap = 0.1;              ///< metres kept to an obstacle on the way
    bool stop_at_each = false;              ///< else waypoints before the last are only passed
};

/// Lists the keys without a section before them.
void describe(ConfigSchema& schema, FollowerConfig& config);

/// A pose that was right some time ago.
struct PoseReading {
    Pose2d map_from_robot;
    double age = 0.0;  ///< seconds; more than 1 is not used
};

/// What is new since the last step. Whether a pose may still be trusted is for the caller to say,
/// who holds when it may not.
struct FollowerInput {
    double seconds = 0.02;            ///< since the last step
    std::optional<PoseReading> pose;  ///< when a new one came
    std::optional<double> speed;      ///< m/s, when the vehicle tells
    std::optional<double> steering;   ///< radians, when the vehicle tells
    /// Metres that the vehicle can go on forwards, or backwards, before it meets something.
    double free_ahead = std::numeric_limits<double>::infinity();
    double free_behind = std::numeric_limits<double>::infinity();
    bool hold = false;  ///< stand still
};

enum class FollowerStatus {
    kNoPose,        ///< waits for the first one
    kTurningWheel,  ///< stands and turns the wheel
    kDriving,
    kHeld,     ///< by the caller or by an obstacle
    kArrived,  ///< stands at the last waypoint
    kOffPath,  ///< stands, or will, and needs another way
};

struct FollowerStep {
    DriveCommand command;
    FollowerStatus status = FollowerStatus::kNoPose;
    Pose2d map_from_robot;              ///< now, as far as known
    double remaining = 0.0;             ///< metres to the end of the way
    double cross_track = 0.0;           ///< metres that the vehicle is left of the way
    double heading_error = 0.0;         ///< radians that it points left of it
    std::size_t waypoints_reached = 0;  ///< passed or stopped at
};

/// What is remembered from step to step; begin each route with a new one or with `begin_route`.
struct FollowerState {
    struct Motion {
        double seconds = 0.0;
        Pose2d before_from_after;
    };

    VehicleState vehicle;  ///< in the map
    DriveCommand command;
    std::vector<Motion> recent;  ///< of the last second, oldest first
    bool has_pose = false;
    std::size_t leg_begin = 0;  ///< points of the way between two stops
    std::size_t leg_end = 0;
    std::size_t segment = 0;  ///< where on the way the vehicle is
    std::size_t waypoints_reached = 0;
    bool turning_wheel = true;
    bool stopping = false;
    bool finished = false;
    bool off_path = false;
};

/// The state with which another way begins: place and motion of the vehicle are kept.
FollowerState begin_route(const FollowerState& before);

/// One step of driving along a way. Between poses the vehicle is dead reckoned with `step`; late
/// poses are carried forward by what was driven since. With the deviations y, h in the frame of
/// the way, per metre driven in direction d: y' = d h, h' = d (k - k_way); so
/// k = k_way - y / c^2 - 2 d h / c makes y'' + 2 y' / c + y / c^2 = 0 in both directions, with c
/// the distance of convergence. k_way is the mean over a window around the vehicle, and the speed
/// such that the wheel can follow it. Throws Error for a route that was not found, the state of
/// another route where that shows, and a time step that is not positive.
FollowerStep follow(const Route& route, const VehicleConfig& vehicle, const FollowerConfig& config,
                    FollowerState& state, const FollowerInput& input);

}  // namespace hybrid_slam
