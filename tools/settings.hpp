// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "hybrid_slam/backend/slam.hpp"
#include "hybrid_slam/core/occupancy_grid.hpp"
#include "hybrid_slam/localization/anchored_session.hpp"
#include "hybrid_slam/localization/localizer.hpp"
#include "hybrid_slam/logs/carmen_log.hpp"
#include "hybrid_slam/segmentation/dnn_floor_segmenter.hpp"
#include "hybrid_slam/vehicle/surroundings.hpp"
#include "hybrid_slam/vision/visual_odometry.hpp"

namespace hybrid_slam::tools {

/// How images are looked at.
struct VisionConfig {
    VisualOdometryConfig odometry;    ///< keys vo.*
    SegmentationConfig segmentation;  ///< tells floor from the rest, if there is a network
};

/// Keys vo.* and segmentation.*
void describe(ConfigSchema& schema, VisionConfig& config);

/// Everything that a configuration file of the program can say.
struct Settings {
    CarmenLogConfig log;
    VisionConfig vision;
    SlamConfig slam;
    OccupancyGridConfig map;
    LocalizationConfig localization;  ///< but for its odometry, which is that of `slam`
    AnchoringConfig anchoring;        ///< of a session to a stored map
    SurroundingsConfig surroundings;  ///< what is in the way, for who drives
};

void describe(ConfigSchema& schema, Settings& settings);

/// With the odometry of the settings.
LocalizationConfig localization_of(const Settings& settings);

/// Whether images are of any use.
inline bool uses_images(const Settings& settings) {
    return settings.slam.odometry.prior.kind == PriorKind::kVisual;
}

/// "key=value"
using Overrides = std::vector<std::string>;

/// What options --set and, where there is one, --seed say. Throws Error that names the key.
void override_with(ConfigSchema& schema, const Overrides& overrides,
                   std::optional<int> seed = std::nullopt);

/// Throws Error that names the key, and the line when it stands in a file. `defaults` hold for what
/// neither of the two says.
Settings load_settings(const std::filesystem::path& file_or_empty, const Overrides& overrides,
                       Settings defaults = {});
Settings with_overrides(Settings settings, const Overrides& overrides);
std::string to_yaml(Settings settings);

/// One of the ways to run the pipeline that `compare` compares: values of options, nothing else.
struct Variant {
    std::string name;
    Overrides overrides;
};

/// For a drive with images: plain ICP, visual odometry alone by the thesis's method and by ours,
/// the pipeline of the thesis, and ours without and with the graph; for one without: plain ICP, and
/// what is configured without and with the graph. Plain ICP has the effect of
/// config/plain_icp.yaml, the thesis's pipeline that of config/thesis.yaml, and the last is what is
/// configured, graph and prior switched on.
std::vector<Variant> comparison_variants(bool images);

}  // namespace hybrid_slam::tools
