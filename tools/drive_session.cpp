// SPDX-License-Identifier: Apache-2.0
#include "drive_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/stopwatch.hpp"
#include "interrupt.hpp"
#include "map_identity.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr double kCycle = 0.02;         ///< seconds
constexpr double kStatusEvery = 0.05;   ///< seconds
constexpr double kDrawEvery = 0.25;     ///< seconds, on a terminal
constexpr double kLongestStep = 0.1;    ///< seconds that a hold-up may count for
constexpr double kPosePatience = 10.0;  ///< seconds of the wall clock, in lockstep

/// What strangers say goes to a terminal and a journal: without what would steer them.
std::string one_line(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
    return text;
}

std::string text_of(const LinkStatus& status) {
    const std::string text = fmt::format("{}, {}", to_string(status.mode), to_string(status.state));
    const std::string& why = status.fault.empty() ? status.reason : status.fault;
    return why.empty() ? text : text + ": " + one_line(why);
}

bool is_news(const LinkStatus& now, const LinkStatus& before) {
    return now.state != before.state || now.mode != before.mode || now.reason != before.reason ||
           now.fault != before.fault || now.goals != before.goals ||
           now.waypoints_left != before.waypoints_left;
}

template <typename What>
bool has(const std::vector<LinkEvent>& events) {
    return std::any_of(events.begin(), events.end(), [](const LinkEvent& event) {
        return std::holds_alternative<What>(event.what);
    });
}

void append(std::vector<LinkEvent>& events, std::vector<LinkEvent> more) {
    std::move(more.begin(), more.end(), std::back_inserter(events));
}

const char* word_for(LinkRole role) {
    return role == LinkRole::kPose ? "pose source"
                                   : (role == LinkRole::kGoal ? "goal client" : "watcher");
}

}  // namespace

DriveSession::DriveSession(DriveSetup setup)
    : setup_(std::move(setup)),
      identity_(identity_of(*setup_.map)),
      log_(setup_.out),
      line_(setup_.quiet),
      server_(setup_.settings.link),
      pilot_(setup_.robot.vehicle, setup_.settings.pilot, identity_),
      routes_(std::make_shared<const ClearanceField>(setup_.map->grid()), setup_.robot.vehicle,
              setup_.settings.pilot.planner, !setup_.clock.empty()),
      fleet_(setup_.settings.fleet, setup_.robot.vehicle, setup_.settings.pilot,
             setup_.robot.name) {
    print_info("listening on " + server_.endpoint().text());
}

/// What strangers can cause must not fill a log: a few lines at once, then one a second.
void DriveSession::say(double now, const std::string& text) {
    constexpr double kMostAtOnce = 20.0;
    may_say_ = std::min(kMostAtOnce, may_say_ + (now - said_at_));
    said_at_ = now;
    if (may_say_ < 1.0) {
        ++unsaid_;
        return;
    }
    may_say_ -= 1.0;
    line_.clear();
    if (unsaid_ > 0) {
        print_info(fmt::format("{} about clients left out", counted(unsaid_, "message")));
        unsaid_ = 0;
    }
    print_info(text);
}

void DriveSession::take_note(const std::vector<LinkEvent>& events, double now) {
    for (const LinkEvent& event : events) {
        if (const auto* const who = std::get_if<LinkConnected>(&event.what)) {
            say(now, fmt::format("{} {} connected{}", word_for(event.role), event.client,
                                 who->name.empty() ? "" : ": " + one_line(who->name)));
            log_.event(now, "connected",
                       {{"client", event.client}, {"role", word_for(event.role)}});
        } else if (const auto* const why = std::get_if<LinkDisconnected>(&event.what)) {
            say(now,
                fmt::format("{} {} is gone: {}", word_for(event.role), event.client, why->reason));
            log_.event(now, "disconnected", {{"client", event.client}, {"reason", why->reason}});
        } else if (const auto* const goals = std::get_if<LinkGoals>(&event.what)) {
            nlohmann::ordered_json places = nlohmann::ordered_json::array();
            for (const LinkWaypoint& each : goals->waypoints) {
                places.push_back({each.place.x(), each.place.y()});
            }
            log_.event(now, "goals", {{"id", goals->id}, {"waypoints", std::move(places)}});
        }
    }
}

void DriveSession::show(const LinkStatus& status, double now) {
    if (!told_any_ || is_news(status, told_)) {
        line_.clear();
        if (!told_any_ || text_of(status) != text_of(told_)) {
            say(now, text_of(status));
        }
    } else if (line_.visible() && now >= next_draw_) {
        next_draw_ = now + kDrawEvery;
        line_.draw(fmt::format("{}; {:.2f} m/s, {:.2f} m to go, pose {:.2f} s old", text_of(status),
                               status.speed, status.remaining, status.pose_age));
    }
}

void DriveSession::tell(const PilotOutput& output, double now) {
    for (const PilotOutput::Refusal& refusal : output.refusals) {
        if (refusal.client == FleetPort::kClient) {
            fleet_.refuse(refusal.reason);
        } else {
            server_.refuse(refusal.client, refusal.reason);
        }
        log_.event(now, "refused", {{"client", refusal.client}, {"reason", refusal.reason}});
    }
    if (output.initial_pose) {
        server_.publish(*output.initial_pose);
    }
    show(output.status, now);
    const bool is_new_pose = output.status.pose_stamp != told_.pose_stamp;
    const bool is_due = setup_.clock.empty()
                            ? is_news(output.status, told_) || now >= next_status_ || is_new_pose
                            : is_new_pose;  // one answer to each pose
    if (!told_any_ || is_due) {
        next_status_ = now + kStatusEvery;
        server_.publish(output.status);
    }
    told_ = output.status;
    told_any_ = true;
    if (!output.news.empty()) {
        say(now, output.news);
    }
    fleet_.publish({output.status, output.pose, truck_->status().feedback.battery});
}

void DriveSession::cycle(double now, double seconds, std::vector<LinkEvent> events) {
    append(events, fleet_.events(now));
    take_note(events, now);
    PilotInput input;
    input.now = now;
    input.seconds = seconds;
    input.events = std::move(events);
    input.drive = truck_->reading(now);
    const PilotOutput output = pilot_.step(input);
    truck_->apply(output);
    routes_.serve(pilot_);
    log_.look(now, output, output.pose, pilot_.route());
    tell(output, now);
}

void DriveSession::run_in_real_time() {
    truck_ = std::make_unique<TruckPort>(setup_.robot.can, setup_.robot.vehicle);
    double before = steady_seconds();
    while (!interrupted()) {
        std::vector<LinkEvent> events;
        const double due = before + kCycle;
        for (double left = kCycle; left > 0.0; left = due - steady_seconds()) {
            append(events, server_.events(left));
        }
        const double now = steady_seconds();
        cycle(now, std::min(now - before, kLongestStep), std::move(events));
        before = now;
    }
}

/// In lockstep the pose of a scan that was taken is waited for, and is told at once: what the wall
/// clock says of it means nothing.
std::vector<LinkEvent> DriveSession::events_for(const LockstepTick& tick) {
    std::vector<LinkEvent> events = server_.events();
    const double end = steady_seconds() + kPosePatience;
    while (tick.pose_due && !has<LinkPose>(events) && !interrupted()) {
        if (steady_seconds() > end) {
            throw Error("lockstep: no pose came for the scan before " +
                        fmt::format("{:.2f} s", tick.now));
        }
        append(events, server_.events(0.2));
    }
    // Time begins with the first places to go to, so that each run is like the other.
    while (!had_goals_ && !has<LinkGoals>(events) && !interrupted()) {
        append(events, server_.events(0.2));
    }
    had_goals_ = true;
    for (LinkEvent& event : events) {
        event.arrival = tick.now;
        event.lateness = 0.0;
    }
    return events;
}

void DriveSession::run_in_lockstep() {
    LockstepDriveClock clock(setup_.clock);
    double before = -kCycle;
    while (!interrupted() && !clock.ended()) {
        const std::optional<LockstepTick> tick = clock.next(0.2);
        if (!tick) {
            continue;
        }
        lockstep_now_ = tick->now;
        if (!truck_) {  // the adapter answers within a tick
            truck_ = std::make_unique<TruckPort>(setup_.robot.can, setup_.robot.vehicle,
                                                 [this] { return lockstep_now_; });
        }
        cycle(tick->now, std::max(tick->now - before, 1e-3), events_for(*tick));
        before = tick->now;
        clock.done(truck_->step(tick->frames));
    }
}

nlohmann::ordered_json DriveSession::run() {
    if (setup_.clock.empty()) {
        run_in_real_time();
    } else {
        run_in_lockstep();
    }
    line_.clear();
    const LinkServerCounts link = server_.counts();
    nlohmann::ordered_json counts = {{"map", {{"path", setup_.map_name}, {"identity", identity_}}},
                                     {"link",
                                      {{"connections", link.connections},
                                       {"turned_away", link.turned_away},
                                       {"lines", link.lines},
                                       {"refused", link.refused}}}};
    if (truck_) {
        const CanCounts& can = truck_->status().counts;
        counts["can"] = {{"port", setup_.robot.can.bus.port},
                         {"sent", can.sent},
                         {"received", can.received},
                         {"dropped", can.dropped},
                         {"errors", can.errors},
                         {"reconnects", truck_->reconnects()}};
    }
    truck_.reset();  // speed zero and power off, before anything that takes time
    return log_.finish({setup_.robot.name + " in " + setup_.map_name, *setup_.map,
                        setup_.robot.vehicle, std::move(counts)});
}

}  // namespace hybrid_slam::tools
