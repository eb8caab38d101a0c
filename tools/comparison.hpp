// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "evaluation.hpp"
#include "hybrid_slam/core/points.hpp"
#include "session.hpp"
#include "settings.hpp"

namespace hybrid_slam::tools {

struct CompareOptions {
    std::filesystem::path drive;
    std::filesystem::path robot;  ///< in place of the recorded one, unless empty
    std::filesystem::path out;
    std::filesystem::path config;
    YardstickFiles yardstick;  ///< without files: the last variant is what the others are held to
    Overrides overrides;
    bool quiet = false;
};

/// What visual odometry took for the images of a drive.
struct VisionCost {
    std::uint64_t images = 0;
    double seconds = 0.0;  ///< of computing; decoding is not in it

    double milliseconds_per_image() const;
};

/// What is kept of a variant's run; its keyframes are not.
struct VariantRun {
    Variant variant;
    Settings settings;  ///< the effective ones
    Session session;
    std::optional<Evaluation> evaluation;  ///< not of the one that the others are held against
    Points points;                         ///< of the map, in its frame
    std::optional<VisionCost> vision;      ///< when the variant looks at images
    double peak_mb = 0.0;

    /// Whether scans were aligned at all.
    bool uses_icp() const { return settings.slam.odometry.reference != ReferenceKind::kNone; }
    /// Into the frame of the truth, where there is one.
    Pose2d truth_from_map() const;
};

struct Comparison {
    std::string drive;                   ///< its name
    std::string config;                  ///< name of the configuration file, if there was one
    Overrides overrides;                 ///< of all variants
    std::optional<Yardstick> yardstick;  ///< set once there are runs
    std::vector<VariantRun> runs;
    Trajectory wheels;
    std::optional<Evaluation> odometry;  ///< of the wheels, when the log has them
    nlohmann::ordered_json input;        ///< counts, of what all of them read
    std::vector<std::string> warnings;
    bool interrupted = false;  ///< runs that were not complete are left out

    /// "sim1 against truth.tum, anchored at the first true pose".
    std::string title() const;
    /// The run with the smallest error; the last where there is no telling.
    const VariantRun& best() const;
    bool has_truth() const { return yardstick && yardstick->has_truth(); }
};

/// Runs the drive once for each variant, until a signal comes (see interrupt.hpp).
Comparison compare(const CompareOptions& options);

/// "VO-seeded ICP + graph" as "vo_seeded_icp_graph".
std::string file_name(const std::string& variant);

}  // namespace hybrid_slam::tools
