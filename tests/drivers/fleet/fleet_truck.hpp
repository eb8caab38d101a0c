// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <deque>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "hybrid_slam/fleet/fleet_protocol.hpp"
#include "messages.hpp"
#include "schema.hpp"

namespace hybrid_slam::test {

inline FleetConfig example_config() {
    FleetConfig config;
    config.manufacturer = "ExampleCo";
    config.serial_number = "FL-0001";
    return config;
}

/// The known pose of a vehicle at rest in the map "hall".
inline FleetStatus status_at(double x, double y, double heading) {
    FleetStatus status;
    status.drive.mode = LinkMode::kAutomatic;
    status.drive.map = "hall";
    status.drive.map_from_robot = Pose2d(x, y, heading);
    status.pose.emplace();
    status.pose->map = "hall";
    status.pose->status = LinkPoseStatus::kTracking;
    status.pose->map_from_robot = {x, y, heading};
    status.pose->covariance = Eigen::Vector3d(4e-4, 1e-4, 1e-4).asDiagonal();
    status.pose->score = 0.9;
    return status;
}

/// A protocol, and a drive that does what it is told: at once, but only when it is asked to.
class FleetTruck {
  public:
    explicit FleetTruck(const FleetConfig& config = example_config(),
                        const FleetVehicle& vehicle = FleetVehicle())
        : protocol(config, vehicle, [] { return std::chrono::system_clock::time_point(); }) {
        tell();
    }

    void send_order(const Json& message) {
        protocol.take_order(message.dump(), now);
        take_events();
    }
    void send_actions(const Json& actions) {
        protocol.take_instant_actions(instant(actions).dump(), now);
        take_events();
    }

    /// The drive takes what came since, as it would in its next cycle.
    void take_events() {
        for (FleetEvent& event : protocol.events()) {
            if (const auto* goals = std::get_if<LinkGoals>(&event)) {
                if (!goals->append) {
                    queue.clear();
                    status.is_paused = false;
                }
                queue.insert(queue.end(), goals->waypoints.begin(), goals->waypoints.end());
                status.drive.goals = goals->id;
                status.drive.state = LinkDriveState::kDriving;
            } else if (const auto* command = std::get_if<LinkCommand>(&event)) {
                obey(*command);
            }
            events.push_back(std::move(event));
        }
        status.drive.waypoints_left = static_cast<int>(queue.size());
    }

    /// One cycle later.
    void tell() {
        now += 0.02;
        status.drive.waypoints_left = static_cast<int>(queue.size());
        if (status.pose) {
            status.pose->stamp = now;
        }
        protocol.update(status, now);
        take_events();
    }

    /// To the next waypoint.
    void drive() {
        ASSERT_FALSE(queue.empty());
        const LinkWaypoint next = queue.front();
        queue.pop_front();
        const Pose2d place(next.place, next.heading.value_or(0.0));
        status.pose->map_from_robot = place;
        status.drive.map_from_robot = place;
        status.drive.state = queue.empty() ? LinkDriveState::kArrived : LinkDriveState::kDriving;
        status.drive.speed = queue.empty() ? 0.0 : 0.3;
        tell();
    }

    /// The state that is due now, or at the latest in a moment; all messages obey their schemas.
    Json state() {
        std::optional<Json> found;
        protocol.announce();
        for (const FleetMessage& message : protocol.due(now)) {
            EXPECT_EQ(schema_fault(message), "") << message.payload;
            if (topic_name(message) == "state") {
                found = Json::parse(message.payload);
            }
        }
        EXPECT_TRUE(found);
        return found.value_or(Json());
    }

    std::vector<std::string> error_types() {
        std::vector<std::string> types;
        const Json told = state();
        for (const Json& error : told["errors"]) {
            types.push_back(error["errorType"]);
        }
        return types;
    }

    /// "WAITING" and so on; empty when there is no such action.
    std::string action_status(const std::string& id) {
        const Json told = state();
        for (const Json& action : told["actionStates"]) {
            if (action["actionId"] == id) {
                return action["actionStatus"];
            }
        }
        return {};
    }

    double now = 100.0;
    FleetStatus status = status_at(0.0, 0.0, 0.0);
    std::deque<LinkWaypoint> queue;
    std::vector<FleetEvent> events;  ///< all so far
    FleetProtocol protocol;

  private:
    void obey(LinkCommand command) {
        if (command == LinkCommand::kCancel) {
            queue.clear();
            status.drive.state = LinkDriveState::kIdle;
        }
        if (command == LinkCommand::kPause || command == LinkCommand::kResume) {
            status.is_paused = command == LinkCommand::kPause;
        }
    }
};

/// The goals among what the truck was told, by their x, in words.
inline std::string goals_of(const FleetTruck& truck) {
    std::string text;
    for (const FleetEvent& event : truck.events) {
        if (const auto* goals = std::get_if<LinkGoals>(&event)) {
            text += goals->id + (goals->append ? "+" : "=");
            for (const LinkWaypoint& waypoint : goals->waypoints) {
                text += std::to_string(static_cast<int>(waypoint.place.x())) + ",";
            }
            text += " ";
        }
    }
    return text;
}

/// nodeId of all nodes that are left, a horizon's in brackets.
inline std::string nodes_left(const Json& state) {
    std::string text;
    for (const Json& node : state["nodeStates"]) {
        const std::string id = node["nodeId"];
        text += node["released"] ? id + " " : "(" + id + ") ";
    }
    return text;
}

}  // namespace hybrid_slam::test
