// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "hybrid_slam/localization/reference_map.hpp"

namespace CLI {
class App;
}

namespace hybrid_slam::tools {

/// What is said about where a localization begins; nothing: the whole map is searched.
struct StartOptions {
    std::vector<double> initial_pose;                 ///< empty, or x, y (metres) and yaw (degrees)
    std::vector<double> initial_sigma = {0.5, 10.0};  ///< metres, degrees
    std::filesystem::path resume;                     ///< folder of a run, or a last_pose.json
};

void add_start_options(CLI::App& command, StartOptions& options);

/// Throws CLI::ValidationError that names the option.
void check_start_options(const StartOptions& options);

/// Where the run begins in the map, if that is known.
struct LocalizationStart {
    std::optional<Pose2d> map_from_robot;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    nlohmann::ordered_json event;  ///< for events.jsonl
};

/// `out`: folder of this run, or empty; `map_path`: of the map, for messages. Throws Error for a
/// place that is not in the map, and for a last pose that is of another one.
LocalizationStart start_of(const StartOptions& options, const std::filesystem::path& out,
                           const std::filesystem::path& map_path, const ReferenceMap& map);

/// Whether the run goes on in the folder where it ended.
bool resumes_itself(const StartOptions& options, const std::filesystem::path& out);

/// In a folder the one that a run keeps there.
std::filesystem::path last_pose_file(const std::filesystem::path& place);

}  // namespace hybrid_slam::tools
