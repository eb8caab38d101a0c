// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {

/// How the vehicle shows itself to a master control (VDA 5050 2.1 over MQTT); docs/vda5050.md.
struct FleetConfig {
    std::string broker;                   ///< tcp://host:1883; empty: no fleet
    std::string interface_name = "uagv";  ///< first level of the topics
    std::string manufacturer = "hybrid_slam";
    std::string serial_number = "0001";
    std::string user;                   ///< at the broker; empty: none
    std::string password;               ///< at the broker
    double state_period = 1.0;          ///< s between states when nothing happens
    double visualization_period = 0.2;  ///< s; 0: none
    int keep_alive = 15;                ///< s after which the broker misses a silent vehicle
    double retry_least = 0.5;           ///< s before a first new attempt, doubled from then on
    double retry_most = 30.0;           ///< s
    /// An order's first node is where the vehicle stands; so near when the order says nothing.
    double start_distance = 0.3;           ///< m
    double start_heading = radians(20.0);  ///< rad
    double init_patience = 10.0;           ///< s until a pose must agree with an initPosition
    /// Take orders whose edges say how to drive (trajectory, orientation, corridor), which this
    /// vehicle plans for itself, instead of refusing them. Speed limits are never ignored.
    bool ignore_edge_hints = false;
};

/// Lists the keys without a section before them.
void describe(ConfigSchema& schema, FleetConfig& config);

/// Throws Error that names the key. An empty broker is no error.
void check(const FleetConfig& config);

}  // namespace hybrid_slam
