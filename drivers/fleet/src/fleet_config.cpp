// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/fleet/fleet_config.hpp"

#include <string_view>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/io/endpoint.hpp"

namespace hybrid_slam {
namespace {

constexpr std::size_t kMostLevelBytes = 128;

/// A level of the topic: '/' would make two of it, '+' and '#' stand for any, '$' is the broker's.
void check_level(const char* key, const std::string& text) {
    if (text.empty() || text.size() > kMostLevelBytes) {
        throw Error(std::string(key) + ": must have 1 to 128 characters");
    }
    for (const char c : text) {
        const bool is_plain = c > ' ' && c < 127;
        if (!is_plain || std::string_view("/$+#").find(c) != std::string_view::npos) {
            throw Error(std::string(key) + ": " + text +
                        " must have no blanks, nor any of / $ + #, for it is part of a topic");
        }
    }
}

/// The standard's own characters of a serial number.
void check_serial(const std::string& text) {
    check_level("serial_number", text);
    const auto stray = text.find_first_not_of(
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_.:-");
    if (stray != std::string::npos) {
        throw Error("serial_number: " + text + " must be of A-Z a-z 0-9 _ . : -");
    }
}

}  // namespace

void describe(ConfigSchema& schema, FleetConfig& config) {
    schema.add("broker", config.broker, "tcp://host:1883 of an MQTT broker; empty: no fleet");
    schema.add("interface_name", config.interface_name, "first level of the topics");
    schema.add("manufacturer", config.manufacturer, "third level of the topics");
    schema.add("serial_number", config.serial_number, "fourth level: this vehicle's own");
    schema.add("user", config.user, "at the broker; empty: none");
    schema.add("password", config.password, "at the broker");
    // The standard wants a state every 30 s at least.
    schema.add("state_period", config.state_period, 0.1, 30.0, "s between states at rest");
    schema.add("visualization_period", config.visualization_period, 0.0, 60.0,
               "s between poses for viewers; 0: none");
    schema.add("keep_alive", config.keep_alive, 1, 600,
               "s after which the broker misses a silent vehicle");
    schema.add("retry_least", config.retry_least, 0.05, 60.0, "s before a first new attempt");
    schema.add("retry_most", config.retry_most, 0.05, 600.0, "s between later ones");
    schema.add("start_distance", config.start_distance, 0.0, 100.0,
               "m to an order's first node, when that says nothing");
    schema.add_degrees("start_heading_deg", config.start_heading, 0.0, 180.0,
                       "from the first node's heading, when that says nothing");
    schema.add("init_patience", config.init_patience, 0.1, 600.0,
               "s until a pose must agree with an initPosition");
    schema.add("ignore_edge_hints", config.ignore_edge_hints,
               "take orders with trajectories, orientations and corridors and plan all the same");
}

void check(const FleetConfig& config) {
    FleetConfig copy = config;
    ConfigSchema schema;
    describe(schema, copy);  // throws for values out of their ranges
    if (config.retry_most < config.retry_least) {
        throw Error("retry_most: must not be less than retry_least");
    }
    check_level("interface_name", config.interface_name);
    check_level("manufacturer", config.manufacturer);
    check_serial(config.serial_number);
    if (!config.broker.empty() && parse_endpoint(config.broker).port == 0) {
        throw Error(config.broker + ": the port must not be 0");
    }
}

}  // namespace hybrid_slam
