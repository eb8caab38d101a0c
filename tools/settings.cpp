// SPDX-License-Identifier: Apache-2.0
#include "settings.hpp"

#include <utility>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam::tools {
namespace {

void describe_log(ConfigSchema& schema, CarmenLogConfig& log) {
    schema.add("range_min", log.range_min, 0.0, 10.0, "m, smaller readings are no return");
    schema.add("range_max", log.range_max, 0.1, 1000.0,
               "m, readings of this and more are no return");
    schema.add("use_odom_lines", log.use_odom_lines,
               "use ODOM lines besides the poses in the laser lines");
}

void describe_map(ConfigSchema& schema, OccupancyGridConfig& map) {
    schema.add("resolution", map.resolution, 0.005, 1.0, "m, size of a cell");
    schema.add("probability_hit", map.probability_hit, 0.501, 0.999,
               "of being occupied, for a cell in which a beam ends");
    schema.add("probability_miss", map.probability_miss, 0.001, 0.499,
               "of being occupied, for a cell that a beam passes");
    schema.add("probability_min", map.probability_min, 0.001, 0.499,
               "lower limit, so that a cell can change");
    schema.add("probability_max", map.probability_max, 0.501, 0.999,
               "upper limit, so that a cell can change");
    schema.add("max_ray", map.max_ray, 0.1, 1000.0, "m, longer beams free the way up to here");
}

// What one key's range cannot say. Before a session rather than after it.
void check(const Settings& settings) {
    const VisualOdometry vision({}, {}, settings.vision.odometry);
    const OdometryConfig& odometry = settings.slam.odometry;
    if (odometry.reference == ReferenceKind::kNone && odometry.prior.kind == PriorKind::kNone) {
        throw Error("odometry.reference and odometry.prior: not both may be none");
    }
    const Slam slam(settings.slam);
    GridGeometry geometry;
    geometry.width = 1;
    geometry.height = 1;
    geometry.resolution = settings.map.resolution;
    const OccupancyGrid grid(geometry, settings.map);
}

}  // namespace

void describe(ConfigSchema& schema, VisionConfig& config) {
    {
        const ConfigSchema::Section section(schema, "vo");
        describe(schema, config.odometry);
    }
    const ConfigSchema::Section section(schema, "segmentation");
    describe(schema, config.segmentation);
}

void describe(ConfigSchema& schema, Settings& settings) {
    {
        const ConfigSchema::Section section(schema, "log");
        describe_log(schema, settings.log);
    }
    describe(schema, settings.vision);
    describe(schema, settings.slam);
    {
        const ConfigSchema::Section section(schema, "map");
        describe_map(schema, settings.map);
    }
    describe_without_odometry(schema, settings.localization);
    {
        const ConfigSchema::Section section(schema, "anchoring");
        describe(schema, settings.anchoring);
    }
    const ConfigSchema::Section section(schema, "surroundings");
    describe(schema, settings.surroundings);
}

LocalizationConfig localization_of(const Settings& settings) {
    LocalizationConfig config = settings.localization;
    config.odometry = settings.slam.odometry;
    return config;
}

void override_with(ConfigSchema& schema, const Overrides& overrides, std::optional<int> seed) {
    for (const std::string& assignment : overrides) {
        schema.override_with(assignment);
    }
    if (seed) {
        schema.override_with("seed=" + std::to_string(*seed));
    }
}

Settings load_settings(const std::filesystem::path& file_or_empty, const Overrides& overrides,
                       Settings defaults) {
    Settings settings = std::move(defaults);
    ConfigSchema schema;
    describe(schema, settings);
    if (!file_or_empty.empty()) {
        schema.load(file_or_empty);
    }
    override_with(schema, overrides);
    check(settings);
    return settings;
}

Settings with_overrides(Settings settings, const Overrides& overrides) {
    ConfigSchema schema;
    describe(schema, settings);
    override_with(schema, overrides);
    return settings;
}

std::string to_yaml(Settings settings) {
    ConfigSchema schema;
    describe(schema, settings);
    return schema.to_yaml();
}

std::vector<Variant> comparison_variants(bool images) {
    const Variant plain{
        "plain ICP",
        {"odometry.prior=none", "odometry.reference=previous_scan", "icp.metric=point_to_point",
         "icp.kernel=none", "odometry.doubtful_overlap=0", "graph.enabled=false"}};
    if (!images) {
        return {plain,
                {"seeded ICP", {"graph.enabled=false"}},
                {"seeded ICP + graph", {"graph.enabled=true"}}};
    }
    return {
        plain,
        {"VO only, thesis",
         {"odometry.prior=visual", "vo.method=thesis", "odometry.reference=none",
          "graph.enabled=false"}},
        {"VO only", {"odometry.prior=visual", "odometry.reference=none", "graph.enabled=false"}},
        {"thesis pipeline",
         {"odometry.prior=visual", "vo.method=thesis", "odometry.reference=previous_scan",
          "icp.metric=point_to_point", "icp.kernel=none", "odometry.doubtful_overlap=0",
          "odometry.doubtful_chi2=1e9", "graph.enabled=true"}},
        {"VO-seeded ICP", {"odometry.prior=visual", "graph.enabled=false"}},
        {"VO-seeded ICP + graph", {"odometry.prior=visual", "graph.enabled=true"}},
    };
}

}  // namespace hybrid_slam::tools
