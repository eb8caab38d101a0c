// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

namespace hybrid_slam {

// Each prints a table of what was measured beside what is asked, and returns how many figures miss.

/// Optimises each graph of `shared_data`/data/posegraph from its odometry, on one thread.
int run_graphs_benchmark(const std::filesystem::path& shared_data, std::ostream& out);

/// Aligns the scan pairs of the relations of `shared_data`/data/slam2d, one at a time, from the
/// odometry's guess and from none.
int run_pairs_benchmark(const std::filesystem::path& shared_data, std::ostream& out);

/// Maps each log of `shared_data`/data/slam2d with the default configuration and audits every
/// accepted closure against the relations. `overrides` are "key=value".
int run_logs_benchmark(const std::filesystem::path& shared_data,
                       const std::vector<std::string>& overrides, std::ostream& out);

/// Maps each simulated world of `worlds` with several seeds and audits closures against the truth.
int run_worlds_benchmark(const std::filesystem::path& worlds,
                         const std::vector<std::string>& overrides, std::ostream& out);

/// Drives the simulated forklift of `worlds` through its sensors' bytes: accuracy of the thesis
/// hall over ten seeds and both range biases, map points against the walls, speed of the simulator.
int run_forklift_benchmark(const std::filesystem::path& worlds,
                           const std::vector<std::string>& overrides, std::ostream& out);

struct VisionOptions {
    std::filesystem::path worlds;        ///< of config; its neighbours are the configurations
    std::filesystem::path shared;        ///< holds data/kitti
    std::vector<std::string> overrides;  ///< "key=value", vo.* too
    int seeds = 10;                      ///< 1 to this, where there are several
    std::vector<std::string> topics;     ///< of vision_topics
};
std::vector<std::string> vision_topics();

/// Drives the simulated forklift with its camera: visual odometry alone, as ICP's first guess and
/// with the graph, in the thesis's hall, with few scans, in a bare corridor and with faults; real
/// images of a street; the speed of it all.
int run_vision_benchmark(const VisionOptions& options, std::ostream& out);

struct LocalizationOptions {
    std::filesystem::path worlds;     ///< of config
    std::filesystem::path shared;     ///< holds data/slam2d
    int seeds = 10;                   ///< 1 to this, where there are several
    std::size_t poses = 1000;         ///< random ones
    std::vector<std::string> topics;  ///< of localization_topics
};
std::vector<std::string> localization_topics();

/// Finds and keeps the place in stored maps: poses in simulated halls and real logs, accuracy and
/// health of tracking, times.
int run_localization_benchmark(const LocalizationOptions& options, std::ostream& out);

/// Kills recorders, cuts and zeroes the last megabyte of a recording at every byte, and measures
/// how fast recordings are written and read.
int run_recording_benchmark(std::ostream& out);

/// Decodes S300 telegrams: the files of `shared_data`/data/s300_telegrams, for speed, and
/// `megabytes` of them among garbage, cuts, splices and flipped bits.
int run_s300_benchmark(const std::filesystem::path& shared_data, double megabytes,
                       std::ostream& out);

/// Reads a scanner at the other end of a pseudo-terminal in real time, whose telegrams arrive late
/// by random: for lost scans and for errors of the stamps.
int run_live_benchmark(double minutes, std::ostream& out);

/// The whole pipeline in real time, a simulated drive's scanner at the other end of a
/// pseudo-terminal and its camera as a video file: processor time, and seconds from a telegram's
/// last byte to the pose.
int run_pipeline_benchmark(const std::filesystem::path& worlds, double minutes, std::ostream& out);

struct NavigationOptions {
    std::filesystem::path program;    ///< hybrid-slam
    std::filesystem::path worlds;     ///< of config
    int seeds = 10;                   ///< 1 to this, of the tables
    int runs = 0;                     ///< of each fault, random trips; 0: 20 and 100
    std::vector<std::string> topics;  ///< of navigation_topics
};
std::vector<std::string> navigation_topics();

/// The forklift in a closed loop of processes, as a user runs them: the thesis's tour, random
/// trips, faults, latency.
int run_navigation_benchmark(const NavigationOptions& options, std::ostream& out);

}  // namespace hybrid_slam
