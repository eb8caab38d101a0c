// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/link/link_server.hpp"
#include "hybrid_slam/link/messages.hpp"
#include "hybrid_slam/vehicle/follower.hpp"
#include "hybrid_slam/vehicle/forklift.hpp"
#include "hybrid_slam/vehicle/planner.hpp"

namespace hybrid_slam {

struct PilotConfig {
    double pose_valid = 0.3;  ///< seconds that a pose may be driven on after it came
    /// Seconds of a pose's own age that SLAM needs anyway; more counts as late.
    double pose_delay = 0.2;
    double pose_jump = 0.5;               ///< metres that a pose may differ from the wheels' way
    std::string pose_source;              ///< name that the pose source must have; empty: any
    double position_sigma = 0.10;         ///< metres, of the pose's worst direction; more: stop
    double heading_sigma = radians(5.0);  ///< radians; more: stop
    double frozen_after = 0.08;      ///< metres by the wheels without the pose moving along: stop
    int most_replans = 5;            ///< of one order, before it is given up
    bool needs_goal_client = false;  ///< stop and forget the places when who sent them is gone
    bool starts_automatic = true;    ///< else in manual mode
    PlannerConfig planner;
    FollowerConfig follower;
};

/// Lists the keys pilot.*, planner.* and follower.*.
void describe(ConfigSchema& schema, PilotConfig& config);

/// What the vehicle's own drive says.
struct DriveReading {
    std::optional<double> speed;     ///< m/s of the fixed axle
    std::optional<double> steering;  ///< radians
    std::string fault;               ///< why it cannot be driven; empty: it can
};

/// What came since the step before.
struct PilotInput {
    double now = 0.0;       ///< seconds of the clock that the events' arrivals are of
    double seconds = 0.02;  ///< since the step before
    std::vector<LinkEvent> events;
    DriveReading drive;
};

struct PilotOutput {
    std::optional<DriveCommand> command;  ///< none: power may go off
    bool manual = false;                  ///< nothing may be sent at all
    LinkStatus status;
    struct Refusal {
        std::uint64_t client = 0;
        std::string reason;
    };
    std::vector<Refusal> refusals;
    std::optional<LinkInitialPose> initial_pose;  ///< for the pose sources
    std::optional<LinkPose> pose;                 ///< the newest of the source that is listened to
    std::string news;                             ///< for people; mostly empty
};

/// A way that is wanted.
struct RouteRequest {
    std::uint64_t number = 0;
    Pose2d start;
    std::vector<Waypoint> waypoints;
};

/// Who drives: takes poses, places to go to and what the drive says, decides whether and how to
/// move. Knows no wire, no thread and no clock but what it is told, so that the same input gives
/// the same output. Planning, which may take seconds, is its owner's: ask for `wanted_route`, give
/// it back with `take`.
///
/// It moves only in automatic mode, on a pose that is fresh, known, sure enough, in this map and
/// moves as the wheels do, as far as the way is told to be free. A fault of the drive on the way
/// and a pose that jumps pause it, and nothing but LinkCommand::kResume ends a pause.
class Pilot {
  public:
    /// `map`: the id that poses must have, if both name one. Throws Error for a config out of
    /// range.
    Pilot(const VehicleConfig& vehicle, const PilotConfig& config, std::string map);
    ~Pilot();
    Pilot(Pilot&&) noexcept;
    Pilot& operator=(Pilot&&) noexcept;

    /// Every 20 ms or so.
    PilotOutput step(const PilotInput& input);

    /// The same request until it is answered or not wanted any more.
    std::optional<RouteRequest> wanted_route() const;
    /// The answer to the request of that number; others are passed over.
    void take(std::uint64_t number, Route route);

    /// The way that is driven, for pictures; nullptr when there is none.
    const Route* route() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
