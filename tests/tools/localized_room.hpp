// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "hybrid_slam/core/metrics.hpp"
#include "running.hpp"

namespace hybrid_slam::test {

/// The room of running.hpp driven through another way: second.clf with second.truth.tum.
inline void simulate_second_way(const TempFolder& folder) {
    folder.write("second.yaml", R"(name: second
walls:
  - {points: [[0, 0], [8, 0], [8, 6], [5, 6], [5, 5], [0, 5]], closed: true}
boxes:
  - {center: [4, 2.5], size: [1.5, 1.0], yaw_deg: 10}
path: [[6.8, 4], [1.5, 4], [1.5, 1.2], [6.0, 1.2]]
simulator: {speed: 1.0, scan_rate: 5, angle_increment: 0.017453292519943295}
)");
    run_well(folder, "simulate second.yaml --out second.clf --seed 2 --quiet");
}

/// The map room/ and the log second.clf of another way through that room.
inline void map_room(const TempFolder& folder) {
    simulate_room(folder);
    simulate_second_way(folder);
    run_well(folder, "map room.clf --out room --quiet");
}

/// A room that looks the same four times: the map square/ and its log square.clf.
inline void map_square(const TempFolder& folder) {
    folder.write("square.yaml", R"(name: square
walls:
  - {points: [[0, 0], [8, 0], [8, 8], [0, 8]], closed: true}
path: [[2, 2], [6, 2], [6, 6], [2, 6], [2, 2]]
simulator: {speed: 1.0, scan_rate: 5, angle_increment: 0.017453292519943295}
)");
    run_well(folder, "simulate square.yaml --out square.clf --quiet");
    run_well(folder, "map square.clf --out square --quiet");
}

/// A drive through quite another room: NAME.clf.
inline void simulate_elsewhere(const TempFolder& folder, const std::string& name = "elsewhere") {
    folder.write(name + ".yaml", "name: " + name + R"(
walls:
  - {points: [[0, 0], [11, 1], [12, 7], [6, 9], [1, 6]], closed: true}
boxes:
  - {center: [7, 4.5], size: [1.0, 2.0], yaw_deg: 30}
path: [[2.5, 2.2], [9.8, 2.5], [9.8, 6]]
simulator: {speed: 1.0, scan_rate: 5, angle_increment: 0.017453292519943295}
)");
    run_well(folder, "simulate " + name + ".yaml --out " + name + ".clf --quiet");
}

/// The map room/ of what the forklift's scanner saw in that room, to be asked live.
inline void map_room_by_forklift(const TempFolder& folder) {
    write_room(folder);
    run_well(folder,
             "simulate room.yaml --out drive --no-camera -q --set speed=1 --set distance=12");
    run_well(folder, "map drive --out room --quiet");
}

/// long.clf: second.clf over and over, for runs that are stopped in the middle.
inline void write_long_drive(const TempFolder& folder) {
    const std::string once = bytes_of(folder / "second.clf");
    std::ofstream stream(folder / "long.clf", std::ios::binary);
    for (int i = 0; i < 400; ++i) {
        stream << once;
    }
}

/// Where the map room/ lies in the world that it was made of.
inline Pose2d world_from_room(const TempFolder& folder) {
    return truth_error(read_tum(folder / "room/trajectory.tum"),
                       read_tum(folder / "room.truth.tum"))
        .truth_from_estimate;
}

inline std::vector<std::string> lines_of(const std::filesystem::path& file) {
    std::ifstream stream(file);
    std::vector<std::string> lines;
    for (std::string line; std::getline(stream, line);) {
        lines.push_back(line);
    }
    return lines;
}

/// The events of one kind.
inline std::vector<Json> events_of(const TempFolder& folder, const std::string& kind,
                                   const std::string& run = "run") {
    std::vector<Json> events;
    for (const std::string& line : lines_of(folder / (run + "/events.jsonl"))) {
        Json event = Json::parse(line);
        if (event["event"] == kind) {
            events.push_back(std::move(event));
        }
    }
    return events;
}

inline Pose2d pose_of(const Json& json) {
    return {json["x_m"], json["y_m"], radians(json["heading_deg"].get<double>())};
}

}  // namespace hybrid_slam::test
