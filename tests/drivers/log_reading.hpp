// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "drivers/scratch_folder.hpp"
#include "hybrid_slam/logs/carmen_log.hpp"

namespace hybrid_slam::test {

/// Everything that a log yields.
struct LogContents {
    std::vector<Measurement> measurements;
    std::vector<Scan> scans;
    std::vector<WheelOdometry> odometry;
    CarmenLogCounts counts;
};

inline LogContents drain(CarmenLog& log) {
    LogContents contents;
    while (std::optional<Measurement> measurement = log.next()) {
        if (const auto* scan = std::get_if<Scan>(&*measurement)) {
            contents.scans.push_back(*scan);
        } else if (const auto* odometry = std::get_if<WheelOdometry>(&*measurement)) {
            contents.odometry.push_back(*odometry);
        }
        contents.measurements.push_back(std::move(*measurement));
    }
    contents.counts = log.counts();
    return contents;
}

inline LogContents read_log(const std::filesystem::path& file, const CarmenLogConfig& config = {}) {
    CarmenLog log(file, config);
    return drain(log);
}

inline LogContents read_text(std::string_view text, const CarmenLogConfig& config = {}) {
    const ScratchFolder folder;
    return read_log(folder.write("log.clf", text), config);
}

/// "FLASER n r.. poses stamp host stamp" with all readings alike.
inline std::string old_laser(std::string_view word, int beams, std::string_view poses,
                             std::string_view stamp, std::string_view reading = "1.50") {
    std::string line = std::string(word) + " " + std::to_string(beams);
    for (int i = 0; i < beams; ++i) {
        line += " " + std::string(reading);
    }
    return line + " " + std::string(poses) + " " + std::string(stamp) + " nohost 0.5\n";
}

}  // namespace hybrid_slam::test
