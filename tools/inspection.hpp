// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "hybrid_slam/recording/recording.hpp"
#include "hybrid_slam/sensors/sensor_source.hpp"
#include "progress.hpp"

namespace hybrid_slam::tools {

struct Gap {
    double after = 0.0;    ///< seconds since the recording began
    double seconds = 0.0;  ///< without anything
};

/// How regularly something came.
struct Cadence {
    std::size_t count = 0;
    double first = 0.0;     ///< seconds since the recording began
    double last = 0.0;      ///< likewise
    double period = 0.0;    ///< seconds, the median; 0 for fewer than two
    std::vector<Gap> gaps;  ///< longer than three periods, in their order

    double rate() const { return period > 0.0 ? 1.0 / period : 0.0; }  ///< Hz
    Gap longest_gap() const;
};

/// `times` in seconds, `begin` that of the recording.
Cadence cadence_of(const std::vector<double>& times, double begin);

/// What was found in a recording.
struct Inspection {
    RecordingManifest manifest;
    RobotConfig robot;
    double begin = 0.0;     ///< seconds, of the first arrival
    double duration = 0.0;  ///< seconds between the first and the last arrival
    SensorCounts counts;
    std::uint64_t lidar_bytes = 0;
    std::uint64_t lidar_chunks = 0;  ///< pieces in which they came
    std::uint64_t image_bytes = 0;
    int image_width = 0;  ///< pixels; 0 when none could be read
    int image_height = 0;
    std::uint64_t damaged_bytes = 0;
    std::uint64_t torn_bytes = 0;  ///< at the ends of the files
    Cadence scans;
    Cadence images;
    double typical_returns = 0.0;  ///< share of the beams, in the median scan
    double most_changed = 0.0;     ///< share of the beams that differ between two scans, at most
    std::vector<Scan> samples;     ///< up to 32, spread over the drive

    bool moved() const;
    double share_of_returns() const;
    double share_missed() const;  ///< of the scans
};

/// Reads the whole recording. Throws Error for one that cannot be opened.
Inspection inspect(const std::filesystem::path& recording, Progress& progress);

/// Whether a map can be made of it.
struct Verdict {
    std::vector<std::string> obstacles;  ///< why not; empty = it can
    std::vector<std::string> warnings;   ///< what does not prevent it

    bool fit() const { return obstacles.empty(); }
};
Verdict judge(const Inspection& inspection);

}  // namespace hybrid_slam::tools
