// SPDX-License-Identifier: Apache-2.0
#include "instant_actions.hpp"

#include <cmath>

#include "outgoing.hpp"

namespace hybrid_slam {
namespace {

constexpr double kInitialDistance = 1.0;  // m; relocalization refines what it was told
constexpr double kInitialTurn = radians(45.0);

const Json& parameter(const FleetAction& action, const char* key) {
    for (const auto& [name, value] : action.parameters) {
        if (name == key) {
            return value;
        }
    }
    throw FleetRefusal(kValidationError, std::string(key) + ": is missing");
}

double number(const FleetAction& action, const char* key) {
    const Json& value = parameter(action, key);
    if (!value.is_number() || !(std::abs(value.get<double>()) <= 1e6)) {
        throw FleetRefusal(kValidationError, std::string(key) + ": must be a number");
    }
    return value.get<double>();
}

std::string text(const FleetAction& action, const char* key) {
    const Json& value = parameter(action, key);
    if (!value.is_string() || value.get_ref<const std::string&>().size() > JsonReader::kMostText) {
        throw FleetRefusal(kValidationError, std::string(key) + ": must be a short text");
    }
    return value.get<std::string>();
}

bool agrees(const Pose2d& pose, const Pose2d& start) {
    return (pose.translation - start.translation).norm() <= kInitialDistance &&
           std::abs(normalize_angle(pose.heading - start.heading)) <= kInitialTurn;
}

/// Cancelled and at rest, whoever else's goals the drive may have.
bool has_stopped(const FleetStatus& status) {
    return is_standing(status) && status.drive.waypoints_left == 0;
}

}  // namespace

InstantActions::Outcome InstantActions::start(const FleetAction& action, const FleetStatus& status,
                                              double now) {
    Outcome out;
    if (states_.has(action.id)) {
        return out;
    }
    const References reference = {{"actionId", action.id}, {"actionType", action.type}};
    if (!states_.add(action.id, action.type)) {
        out.is_refused = true;
        out.problems.push_back({kValidationError, "too many actions are running", reference});
        return out;
    }
    try {
        begin(action, status, now, out);
    } catch (const FleetRefusal& refusal) {
        states_.set(action.id, ActionStatus::kFailed, refusal.what());
        out.is_refused = true;
        out.problems.push_back({refusal.problem.type, refusal.problem.text, reference});
    }
    return out;
}

void InstantActions::begin(const FleetAction& action, const FleetStatus& status, double now,
                           Outcome& out) {
    if (action.type == "stateRequest" || action.type == "factsheetRequest") {
        out.wants_factsheet = action.type == "factsheetRequest";
        out.wants_state = true;
        states_.set(action.id, ActionStatus::kFinished);
    } else if (action.type == "startPause" || action.type == "stopPause") {
        begin_pause(action, status, out);
    } else if (action.type == "cancelOrder") {
        begin_cancel(out);
    } else if (action.type == "initPosition") {
        begin_initial(action, status, now, out);
    } else {
        throw FleetRefusal(kValidationError, "action not supported");
    }
}

void InstantActions::begin_pause(const FleetAction& action, const FleetStatus& status,
                                 Outcome& out) {
    if (status.drive.mode == LinkMode::kManual) {
        throw FleetRefusal(kOrderError, "the vehicle is driven by hand");
    }
    const bool is_start = action.type == "startPause";
    states_.end_all(is_start ? "stopPause" : "startPause", ActionStatus::kFailed,
                    "overtaken by " + action.id);
    out.events.emplace_back(is_start ? LinkCommand::kPause : LinkCommand::kResume);
}

/// A second one waits for the same end.
void InstantActions::begin_cancel(Outcome& out) const {
    if (!book_.is_active()) {
        throw FleetRefusal(kNoOrderToCancel, "there is no order");
    }
    out.events.emplace_back(LinkCommand::kCancel);
}

void InstantActions::begin_initial(const FleetAction& action, const FleetStatus& status, double now,
                                   Outcome& out) {
    Initial initial;
    initial.action = action.id;
    initial.start.map_from_robot = {number(action, "x"), number(action, "y"),
                                    normalize_angle(number(action, "theta"))};
    initial.start.map = text(action, "mapId");
    initial.last_node = text(action, "lastNodeId");
    if (initial.start.map != status.drive.map) {
        throw FleetRefusal(kOrderError,
                           "mapId: the vehicle is in the map '" + status.drive.map + "'");
    }
    if (book_.is_active() || !is_standing(status)) {
        throw FleetRefusal(kOrderError, "the vehicle must stand, without an order");
    }
    states_.end_all("initPosition", ActionStatus::kFailed, "overtaken by " + action.id);
    states_.set(action.id, ActionStatus::kRunning);
    initial.stamp_before = status.pose ? status.pose->stamp : 0.0;
    initial.deadline = now + config_.init_patience;
    out.events.emplace_back(initial.start);
    initial_ = std::move(initial);
}

bool InstantActions::follow(const FleetStatus& status, double now) {
    bool is_changed = false;
    if (is_paused(status) && is_standing(status)) {
        is_changed |= states_.end_all("startPause", ActionStatus::kFinished);
    }
    if (!is_paused(status)) {
        is_changed |= states_.end_all("stopPause", ActionStatus::kFinished);
    }
    if (states_.is_running("cancelOrder") && (has_stopped(status) || !book_.is_active())) {
        book_.end();
        states_.end_all("cancelOrder", ActionStatus::kFinished);
        is_changed = true;
    }
    return follow_initial(status, now) || is_changed;
}

bool InstantActions::follow_initial(const FleetStatus& status, double now) {
    if (!initial_) {
        return false;
    }
    const bool is_new = status.pose && status.pose->stamp != initial_->stamp_before;
    if (is_new && is_localized(status) &&
        agrees(status.pose->map_from_robot, initial_->start.map_from_robot)) {
        book_.set_last_node(initial_->last_node);
        states_.set(initial_->action, ActionStatus::kFinished);
    } else if (now >= initial_->deadline) {
        states_.set(initial_->action, ActionStatus::kFailed, "no pose near it was found in time");
    } else {
        return false;
    }
    initial_.reset();
    return true;
}

void InstantActions::drop_for_manual() {
    states_.end_all("cancelOrder", ActionStatus::kFinished);
    states_.end_all("startPause", ActionStatus::kFailed, "the vehicle is driven by hand");
    states_.end_all("stopPause", ActionStatus::kFailed, "the vehicle is driven by hand");
}

}  // namespace hybrid_slam
