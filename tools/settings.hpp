// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "hybrid_slam/backend/slam.hpp"
#include "hybrid_slam/core/occupancy_grid.hpp"
#include "hybrid_slam/logs/carmen_log.hpp"

namespace hybrid_slam::tools {

/// Everything that a configuration file of the program can say.
struct Settings {
    CarmenLogConfig log;
    SlamConfig slam;
    OccupancyGridConfig map;
};

void describe(ConfigSchema& schema, Settings& settings);

/// "key=value"
using Overrides = std::vector<std::string>;

/// Throws Error that names the key, and the line when it stands in a file.
Settings load_settings(const std::filesystem::path& file_or_empty, const Overrides& overrides);
Settings with_overrides(Settings settings, const Overrides& overrides);
std::string to_yaml(Settings settings);

/// One of the ways to run the pipeline that `compare` compares: values of options, nothing else.
struct Variant {
    std::string name;
    Overrides overrides;
};

/// Plain ICP as in the thesis, the same seeded by a prior, and with the graph on top. The first has
/// the effect of config/plain_icp.yaml.
std::vector<Variant> comparison_variants();

}  // namespace hybrid_slam::tools
