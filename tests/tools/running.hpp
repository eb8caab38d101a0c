// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "support/temp_folder.hpp"

namespace hybrid_slam::test {

using Json = nlohmann::ordered_json;

struct Outcome {
    int code = -1;
    std::string out;
    std::string err;

    Json json() const { return Json::parse(out); }
};

/// Runs the built program inside of the folder, with the arguments as a shell reads them.
inline Outcome run(const TempFolder& folder, const std::string& arguments) {
    const std::string command = "cd '" + folder.path().string() +
                                "' && '" HYBRID_SLAM_PROGRAM "' " + arguments +
                                " > stdout.txt 2> stderr.txt";
    const int status = std::system(command.c_str());
    Outcome result;
    result.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    result.out = bytes_of(folder / "stdout.txt");
    result.err = bytes_of(folder / "stderr.txt");
    return result;
}

/// A run that must succeed.
inline Outcome run_well(const TempFolder& folder, const std::string& arguments) {
    Outcome result = run(folder, arguments);
    EXPECT_EQ(result.code, 0) << arguments << "\n" << result.err;
    return result;
}

/// A room of 8 x 6 m with a box in it, driven around once: less than two seconds of work.
inline std::filesystem::path write_room(const TempFolder& folder) {
    return folder.write("room.yaml", R"(name: room
walls:
  - {points: [[0, 0], [8, 0], [8, 6], [5, 6], [5, 5], [0, 5]], closed: true}
boxes:
  - {center: [4, 2.5], size: [1.5, 1.0], yaw_deg: 10}
path: [[1.5, 1.2], [6.8, 1.2], [6.8, 4], [1.5, 4], [1.5, 1.2]]
laps: 2
simulator: {speed: 1.0, scan_rate: 5, angle_increment: 0.017453292519943295}
)");
}

/// The same as a log: room.clf with room.truth.tum beside it.
inline void simulate_room(const TempFolder& folder) {
    write_room(folder);
    run_well(folder, "simulate room.yaml --out room.clf --quiet");
}

/// Compares without printing both when they differ.
inline bool same_bytes(const std::filesystem::path& a, const std::filesystem::path& b) {
    const std::string bytes = bytes_of(a);
    return !bytes.empty() && bytes == bytes_of(b);
}

}  // namespace hybrid_slam::test
