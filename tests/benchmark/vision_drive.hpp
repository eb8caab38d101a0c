// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "benchmarks.hpp"
#include "hybrid_slam/simulator/simulated_vehicle.hpp"
#include "hybrid_slam/vision/visual_odometry.hpp"
#include "session.hpp"

namespace hybrid_slam {

/// One way to run the pipeline.
struct Way {
    VisualOdometryConfig vo;
    SlamConfig slam;
};

/// Of a configuration file (none when empty) and "key=value" on top. Throws Error for unknown keys.
Way read_way(const std::filesystem::path& file_or_empty, const std::vector<std::string>& overrides);

/// The ways of `hybrid-slam compare`, in its order: plain ICP and the thesis's pipeline by their
/// shipped configuration, the others by the options that differ from what is configured.
enum WayIndex : std::size_t { kPlain, kVoThesis, kVo, kThesis, kSeeded, kSeededGraph, kWays };
std::string name_of(WayIndex way);
std::vector<Way> comparison_ways(const VisionOptions& options);

/// A simulated drive of the default robot.
struct DriveChoice {
    World world;
    std::string path;
    SimulatedDriveConfig config;
    std::size_t scan_step = 1;  ///< every so many scans is kept; the others nobody gets to see
};

/// One drive, its images decoded and looked at once by both methods: scans and visual motions.
struct SeenDrive {
    std::map<VisualMethod, std::vector<Measurement>> measurements;
    std::map<VisualMethod, std::map<VisualStatus, std::size_t>> statuses;
    Trajectory truth;
    std::size_t scans = 0;

    double highest_turn_rate() const;  ///< rad/s, true
};
SeenDrive see_drive(const DriveChoice& choice, const VisualOdometryConfig& vo);

/// "12 first, 340 good"
std::string words_of(const std::map<VisualStatus, std::size_t>& statuses);

/// The drive once more, by its motions of way.vo.method.
Session replay(const SeenDrive& drive, const Way& way);

/// Errors of a trajectory that is anchored at the first true pose.
struct DriveErrors {
    double rmse = 0.0;              ///< metres
    double heading_rmse_deg = 0.0;  ///< degrees
    double greatest = 0.0;          ///< metres
    double at_end = 0.0;            ///< metres
    double drift_rmse_deg = 0.0;    ///< degrees, of the heading over 10 m of way
    double drift_greatest_deg = 0.0;
    std::size_t icp_failures = 0;

    void take_worst(const DriveErrors& other);
};
DriveErrors errors_of(const Session& session, const Trajectory& truth);

}  // namespace hybrid_slam
