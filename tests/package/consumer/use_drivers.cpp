// SPDX-License-Identifier: Apache-2.0
#include <hybrid_slam/logs/carmen_log.hpp>
#include <hybrid_slam/simulator/simulator.hpp>
#include <iostream>

// Drives a world of the installed configuration into a log and reads the log back.
int main(int argc, char** argv) {
    if (argc != 2) {
        std::cerr << "usage: use_drivers WORLD.yaml\n";
        return 2;
    }
    const char* const file = "drive.clf.gz";
    hybrid_slam::Simulator simulator(hybrid_slam::read_world(argv[1]), {});
    hybrid_slam::CarmenLogWriter writer(file);
    while (auto measurement = simulator.next()) {
        writer.push(*measurement);
    }
    writer.close();

    hybrid_slam::CarmenLog log(file);
    while (log.next()) {
    }
    std::cout << log.counts().scans << " scans in " << file << '\n';
    return log.counts().scans == simulator.truth().size() ? 0 : 1;
}
