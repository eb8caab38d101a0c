// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/pilot/pilot.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "orders.hpp"
#include "pose_watch.hpp"

namespace hybrid_slam {
namespace {

constexpr double kStanding = 0.005;        ///< m/s
constexpr double kTakeOverPatience = 2.0;  ///< seconds for a stop before the vehicle is let go
constexpr double kJumpWanted = 10.0;  ///< seconds that SLAM has to go where it was told to begin
constexpr int kMostWaiting = 1000;    ///< waypoints
constexpr double kOrderValid = 1.0;   ///< seconds; whoever sent an older one may not watch any more
constexpr double kMostSpeed = 50.0;   ///< m/s; more is no measurement
constexpr double kMostSteering = 2.0 * kPi;  ///< radians, likewise

PilotConfig checked(PilotConfig config) {
    ConfigSchema schema;
    describe(schema, config);  // throws for values out of their ranges
    return config;
}

}  // namespace

struct Pilot::State {
    State(const VehicleConfig& the_vehicle, const PilotConfig& how, std::string the_map)
        : vehicle(steerable(the_vehicle)),
          config(checked(how)),
          map(std::move(the_map)),
          poses(config, map),
          mode(config.starts_automatic ? LinkMode::kAutomatic : LinkMode::kManual) {}

    PilotOutput step(const PilotInput& input);
    void take(const LinkEvent& event, const LinkGoals& wanted);
    void take(const LinkEvent& event, const LinkInitialPose& pose);
    void take(const LinkEvent& event, LinkCommand command);
    void take(const LinkEvent& event);
    bool is_too_late(const LinkEvent& event, const std::string& what);
    void lose(std::uint64_t client);
    void abandon(std::string why);
    void pause(std::string why);
    void look_at_drive(const PilotInput& input);
    void rest();
    void go(const PilotInput& input);
    void finish_dropping();
    void replan();
    void ask_for_route();
    std::string hold_reason() const;
    void hand_over(double seconds);
    void tell();
    LinkDriveState drive_state() const;
    int waypoints_left() const;

    VehicleConfig vehicle;
    PilotConfig config;
    std::string map;
    PoseWatch poses;

    double now = 0.0;  ///< seconds, of this step
    LinkMode mode;
    bool paused = false;
    std::string why_paused;  ///< when nobody asked for it
    std::string fault;
    Orders orders;
    std::optional<RouteRequest> request;
    std::uint64_t requests = 0;
    std::optional<Route> route;
    bool arrived = false;
    std::string note;  ///< why there is nothing to do any more
    std::string goals;

    FollowerState follower;
    FollowerStep last;
    double speed = 0.0;
    double steering = 0.0;
    double stopping_for = 0.0;  ///< seconds since manual mode was asked for
    bool standing = true;
    bool released = false;                    ///< to somebody who drives by hand
    std::vector<PilotOutput::Refusal> later;  ///< refusals for the next step
    PilotOutput out;
};

/// Whether that came so long ago that it would move the vehicle by surprise.
bool Pilot::State::is_too_late(const LinkEvent& event, const std::string& what) {
    if (now - event.arrival <= kOrderValid) {
        return false;
    }
    out.refusals.push_back({event.client, what + ": the drive was held up; send it again"});
    return true;
}

void Pilot::State::take(const LinkEvent& event, const LinkGoals& wanted) {
    if (is_too_late(event, "goals")) {
        return;
    }
    if (mode == LinkMode::kManual) {
        out.refusals.push_back({event.client, "goals: the vehicle is in manual mode"});
        return;
    }
    if (!fault.empty()) {
        // It must not move by itself as soon as somebody has mended it.
        out.refusals.push_back({event.client, "goals: the drive has a fault: " + fault});
        return;
    }
    if (wanted.append && waypoints_left() > kMostWaiting) {
        out.refusals.push_back({event.client, "goals: too many places wait already"});
        return;
    }
    poses.expect_no_jump();
    orders.add(wanted, event.client);
    goals = wanted.id;
    arrived = false;
    note.clear();
}

/// Stops, and forgets where it was to go.
void Pilot::State::abandon(std::string why) {
    orders.abandon();
    note = std::move(why);
    arrived = false;
}

void Pilot::State::take(const LinkEvent& event, LinkCommand command) {
    switch (command) {
        case LinkCommand::kCancel:
            abandon("cancelled");
            break;
        case LinkCommand::kPause:
            paused = true;
            break;
        case LinkCommand::kResume:
            if (is_too_late(event, "resume")) {
                break;
            }
            if (!fault.empty()) {
                // It must not move by itself as soon as somebody has mended it.
                out.refusals.push_back({event.client, "resume: the drive has a fault: " + fault});
                break;
            }
            paused = false;
            why_paused.clear();
            break;
        case LinkCommand::kManual:
            if (mode != LinkMode::kManual) {
                abandon("");
                mode = LinkMode::kManual;
                stopping_for = 0.0;
            }
            break;
        case LinkCommand::kAutomatic:
            mode = LinkMode::kAutomatic;
            break;
    }
}

/// A vehicle that is on its way must not be put elsewhere.
void Pilot::State::take(const LinkEvent& event, const LinkInitialPose& pose) {
    if (!orders.empty() || !standing) {
        out.refusals.push_back(
            {event.client, "initial pose: the vehicle must stand, without places to go to"});
    } else if (!poses.has_source()) {
        out.refusals.push_back({event.client, "initial pose: no SLAM is connected"});
    } else {
        poses.expect_jump(event.arrival + kJumpWanted);
        out.initial_pose = pose;
    }
}

void Pilot::State::lose(std::uint64_t client) {
    poses.gone(client);
    if (config.needs_goal_client && orders.are_of(client)) {
        abandon("the goal client is gone");
    }
}

void Pilot::State::take(const LinkEvent& event) {
    if (const auto* const pose = std::get_if<LinkPose>(&event.what)) {
        if (const auto reason = poses.take(event, *pose)) {
            out.refusals.push_back({event.client, *reason});
        }
    } else if (const auto* const wanted = std::get_if<LinkGoals>(&event.what)) {
        take(event, *wanted);
    } else if (const auto* const command = std::get_if<LinkCommand>(&event.what)) {
        take(event, *command);
    } else if (const auto* const pose_told = std::get_if<LinkInitialPose>(&event.what)) {
        take(event, *pose_told);
    } else if (const auto* const who = std::get_if<LinkConnected>(&event.what)) {
        poses.connected(event.client, who->name);
    } else if (std::holds_alternative<LinkDisconnected>(event.what)) {
        lose(event.client);
    }
}

void Pilot::State::pause(std::string why) {
    paused = true;
    why_paused = std::move(why);
}

void Pilot::State::look_at_drive(const PilotInput& input) {
    speed = input.drive.speed.value_or(last.command.speed);
    steering = input.drive.steering.value_or(last.command.steering);
    std::string trouble = input.drive.fault;
    // Put so that what is no number is no measurement either.
    if (!(std::abs(speed) <= kMostSpeed) || !(std::abs(steering) <= kMostSteering)) {
        trouble = "the drive tells a speed or steering angle that cannot be";
        speed = 0.0;
        steering = 0.0;
    }
    standing = std::abs(speed) < kStanding;
    // What was only commanded, in a dry run, moves nobody.
    poses.drive(input.now, input.drive.speed ? speed * input.seconds : 0.0);
    if (fault.empty() && !trouble.empty() && !orders.empty()) {
        // It must not start again by itself as soon as somebody has mended it.
        pause("the drive had a fault; resume when all is well");
    }
    fault = std::move(trouble);
}

/// Why the vehicle must not move; empty when it may.
std::string Pilot::State::hold_reason() const {
    if (!fault.empty()) {
        return fault;
    }
    if (orders.dropping()) {
        return "stopping";
    }
    if (paused) {
        return why_paused.empty() ? "paused" : why_paused;
    }
    return poses.objection(now);
}

void Pilot::State::finish_dropping() {
    if (orders.dropping() && standing) {
        orders.drop();
        request.reset();
        route.reset();
    }
}

void Pilot::State::ask_for_route() {
    orders.begin();
    if (orders.active() != nullptr && !request && standing) {
        request = {++requests, *poses.last_known(), orders.active()->ahead()};
    }
}

/// The vehicle is beside its way, or has stopped too far from where it should be.
void Pilot::State::replan() {
    Order& order = *orders.active();
    order.reached += last.waypoints_reached;
    route.reset();
    if (++order.replans > config.most_replans || order.ahead().empty()) {
        abandon("the places are not reached: every new way was left again");
    }
}

void Pilot::State::rest() {
    last = {};
    last.command.steering = steering;
    if (!standing) {
        out.command = last.command;  // rolling, or nearly so
    }
    if (mode == LinkMode::kAutomatic && hold_reason().empty()) {
        ask_for_route();
    }
}

void Pilot::State::go(const PilotInput& input) {
    FollowerInput seen;
    seen.seconds = input.seconds;
    seen.pose = poses.fresh(now);
    seen.speed = input.drive.speed;
    seen.steering = input.drive.steering;
    seen.free_ahead = poses.free_ahead();
    seen.free_behind = poses.free_behind();
    seen.hold = !hold_reason().empty();
    last = follow(*route, vehicle, config.follower, follower, seen);
    // Held for long, the power may go off.
    if (fault.empty() && !(seen.hold && standing)) {
        out.command = last.command;
    }
    if (last.status == FollowerStatus::kArrived && standing) {
        orders.finish();
        route.reset();
        arrived = orders.empty();
    } else if (last.status == FollowerStatus::kOffPath && standing && !seen.hold) {
        replan();
    }
}

int Pilot::State::waypoints_left() const {
    const bool counts_now = route && !orders.dropping();
    return static_cast<int>(orders.waypoints_left() - (counts_now ? last.waypoints_reached : 0));
}

LinkDriveState Pilot::State::drive_state() const {
    if (!fault.empty()) {
        return LinkDriveState::kFault;
    }
    if (mode == LinkMode::kManual) {
        return LinkDriveState::kIdle;
    }
    if (paused) {
        return LinkDriveState::kPaused;
    }
    if (orders.empty()) {
        return arrived ? LinkDriveState::kArrived : LinkDriveState::kIdle;
    }
    const bool moves = route && (last.status == FollowerStatus::kDriving ||
                                 last.status == FollowerStatus::kTurningWheel);
    return moves ? LinkDriveState::kDriving : LinkDriveState::kStopped;
}

void Pilot::State::tell() {
    LinkStatus& status = out.status;
    status.mode = mode;
    status.state = drive_state();
    status.fault = fault;
    status.goals = goals;
    status.map = map;
    status.map_from_robot = poses.last_known();
    status.pose_age = status.map_from_robot ? std::max(0.0, poses.age(now)) : 0.0;
    status.pose_stamp = poses.newest_stamp();
    status.speed = speed;
    status.steering = steering;
    status.waypoints_left = waypoints_left();
    status.remaining = route ? last.remaining : 0.0;
    if (status.state == LinkDriveState::kDriving || status.state == LinkDriveState::kArrived) {
        return;
    }
    if (mode == LinkMode::kManual) {
        status.reason = "manual mode";
    } else if (orders.empty() && !paused) {
        status.reason = note;
    } else if (const std::string why = hold_reason(); !why.empty()) {
        status.reason = why;
    } else if (request) {
        status.reason = "looking for a way";
    } else if (route && last.status == FollowerStatus::kHeld) {
        status.reason = "something is in the way";
    }
}

/// Stops first, unless it cannot: somebody drives already.
void Pilot::State::hand_over(double seconds) {
    if (mode == LinkMode::kAutomatic) {
        released = false;
        return;
    }
    stopping_for += seconds;
    released = released || standing || stopping_for > kTakeOverPatience;
    out.manual = released;
    if (released) {
        out.command.reset();
    }
}

PilotOutput Pilot::State::step(const PilotInput& input) {
    out = {};
    now = input.now;
    out.refusals = std::exchange(later, {});
    look_at_drive(input);
    for (const LinkEvent& event : input.events) {
        take(event);
    }
    if (const std::string jump = poses.jump(); !jump.empty()) {
        pause(jump + "; resume if it is right now");
    }
    finish_dropping();
    if (route) {
        go(input);
    } else {
        rest();
    }
    hand_over(input.seconds);
    tell();
    out.news = poses.news();
    if (poses.newest() != nullptr) {
        out.pose = *poses.newest();
    }
    return std::exchange(out, {});
}

Pilot::Pilot(const VehicleConfig& vehicle, const PilotConfig& config, std::string map)
    : state_(std::make_unique<State>(vehicle, config, std::move(map))) {}
Pilot::~Pilot() = default;
Pilot::Pilot(Pilot&&) noexcept = default;
Pilot& Pilot::operator=(Pilot&&) noexcept = default;

PilotOutput Pilot::step(const PilotInput& input) {
    if (!(input.seconds > 0.0)) {
        throw Error("pilot: a time step must be positive");
    }
    return state_->step(input);
}

std::optional<RouteRequest> Pilot::wanted_route() const {
    return state_->request;
}

void Pilot::take(std::uint64_t number, Route route) {
    State& state = *state_;
    if (!state.request || state.request->number != number || state.orders.active() == nullptr) {
        return;
    }
    const RouteRequest asked = *std::exchange(state.request, std::nullopt);
    if (state.orders.dropping()) {
        return;  // nobody wants to go there any more, and others wait
    }
    if (route.status != PlanStatus::kFound) {
        const std::string why = why_no_way(route, asked.waypoints);
        state.later.push_back({state.orders.active()->client, why});
        state.abandon(why);
        return;
    }
    state.follower = begin_route(state.follower);
    state.follower.vehicle = {*state.poses.last_known(), 0.0, state.steering};
    state.follower.has_pose = true;
    state.route = std::move(route);
}

const Route* Pilot::route() const {
    return state_->route ? &*state_->route : nullptr;
}

}  // namespace hybrid_slam
