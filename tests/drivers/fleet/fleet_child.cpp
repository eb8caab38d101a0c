// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <thread>

#include "hybrid_slam/fleet/fleet_client.hpp"

/// fleet_child BROKER: a vehicle at rest, until it is killed.
int main(int argc, char** argv) {
    if (argc != 2) {
        return 2;
    }
    hybrid_slam::FleetConfig config;
    config.broker = argv[1];
    config.manufacturer = "ExampleCo";
    config.serial_number = "FL-0001";
    hybrid_slam::FleetClient client(config, {});
    for (;;) {
        client.publish({});
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
}
