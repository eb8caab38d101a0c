// SPDX-License-Identifier: Apache-2.0
#include "fleet_port.hpp"

#include <algorithm>
#include <cmath>

#include "hybrid_slam/core/error.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {

#ifdef HYBRID_SLAM_HAS_FLEET

namespace {

FleetVehicle facts_of(const VehicleConfig& vehicle, const PilotConfig& pilot,
                      const std::string& name) {
    FleetVehicle facts;
    facts.series = name;
    facts.wheelbase = vehicle.wheelbase;
    facts.speed_most = std::min(vehicle.speed_limit, pilot.follower.speed_limit);
    facts.acceleration = vehicle.acceleration;
    facts.deceleration = vehicle.acceleration;
    facts.length = vehicle.footprint_front + vehicle.footprint_rear;
    facts.width = vehicle.footprint_width;
    const double side = vehicle.footprint_width / 2.0;
    facts.footprint = {{vehicle.footprint_front, side},
                       {-vehicle.footprint_rear, side},
                       {-vehicle.footprint_rear, -side},
                       {vehicle.footprint_front, -side}};
    return facts;
}

}  // namespace

struct FleetPort::State {
    State(const FleetConfig& config, const FleetVehicle& vehicle)
        : broker(config.broker), client(config, vehicle) {}

    void tell_news() {
        const FleetReport report = client.report();
        if (report.is_connected && !was_connected) {
            print_info("fleet: connected to " + broker);
        } else if (!report.is_connected && !report.trouble.empty() &&
                   (was_connected || report.trouble != trouble)) {
            print_warning("fleet: " + report.trouble + "; driving goes on without it");
        }
        was_connected = report.is_connected;
        trouble = report.trouble;
    }

    std::string broker;
    FleetClient client;
    bool was_connected = false;
    std::string trouble;
};

FleetPort::FleetPort(const FleetConfig& config, const VehicleConfig& vehicle,
                     const PilotConfig& pilot, const std::string& name)
    : state_(config.broker.empty()
                 ? nullptr
                 : std::make_unique<State>(config, facts_of(vehicle, pilot, name))) {}

std::vector<LinkEvent> FleetPort::events(double now) {
    std::vector<LinkEvent> events;
    if (!state_) {
        return events;
    }
    state_->tell_news();
    // They came since the last call, which may be long ago for a drive that was held up.
    looked_at_ = looked_at_.value_or(now);
    for (const FleetEvent& wanted : state_->client.events()) {
        LinkEvent event;
        event.client = kClient;
        event.role = LinkRole::kGoal;
        event.arrival = *looked_at_;
        if (const auto* const goals = std::get_if<LinkGoals>(&wanted)) {
            event.what = *goals;
        } else if (const auto* const command = std::get_if<LinkCommand>(&wanted)) {
            event.what = *command;
        } else {
            event.what = LinkInitialPose{std::get<FleetInitialPose>(wanted).map_from_robot};
        }
        events.push_back(std::move(event));
    }
    looked_at_ = now;
    return events;
}

void FleetPort::refuse(const std::string& reason) {
    if (state_) {
        state_->client.refuse(reason);
    }
}

void FleetPort::publish(const Facts& facts) {
    if (!state_) {
        return;
    }
    FleetStatus status;
    status.drive = facts.drive;
    status.pose = facts.pose;
    if (facts.battery) {
        status.battery = 100.0 * *facts.battery;
    }
    status.is_paused = facts.drive.state == LinkDriveState::kPaused;
    status.is_protective = facts.pose && facts.pose->is_protective;
    state_->client.publish(status);
}

#else

void describe(ConfigSchema& schema, FleetConfig& config) {
    schema.add("broker", config.broker, "this program was built without MQTT");
}

struct FleetPort::State {};

FleetPort::FleetPort(const FleetConfig& config, const VehicleConfig& /*vehicle*/,
                     const PilotConfig& /*pilot*/, const std::string& /*name*/) {
    if (!config.broker.empty()) {
        throw Error("fleet.broker: this program was built without MQTT (libpaho-mqttpp-dev)");
    }
}

std::vector<LinkEvent> FleetPort::events(double /*now*/) {
    return {};
}

void FleetPort::refuse(const std::string& /*reason*/) {}

void FleetPort::publish(const Facts& /*facts*/) {}

#endif

FleetPort::~FleetPort() = default;

}  // namespace hybrid_slam::tools
