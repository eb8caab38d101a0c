// SPDX-License-Identifier: Apache-2.0
#include "localization_config.hpp"

namespace hybrid_slam {

LocalizationConfig checked(LocalizationConfig config) {
    ConfigSchema schema;
    describe(schema, config);
    expect_consistent(config.odometry.icp);
    return config;
}

std::string_view to_string(LocalizationStatus status) {
    switch (status) {
        case LocalizationStatus::kRelocalizing:
            return "relocalizing";
        case LocalizationStatus::kTracking:
            return "tracking";
        case LocalizationStatus::kDegraded:
            return "degraded";
        case LocalizationStatus::kLost:
            return "lost";
    }
    return "unknown";
}

void describe(ConfigSchema& schema, LocalizationConfig& config) {
    describe(schema, config.odometry);
    describe_without_odometry(schema, config);
}

void describe_without_odometry(ConfigSchema& schema, LocalizationConfig& config) {
    {
        const ConfigSchema::Section section(schema, "relocalization");
        describe(schema, config.relocalization);
    }
    {
        const ConfigSchema::Section section(schema, "particles");
        describe(schema, config.particles);
    }
    {
        const ConfigSchema::Section section(schema, "tracking");
        describe(schema, config.tracking);
    }
    const ConfigSchema::Section section(schema, "localization");
    schema.add("query_path", config.query_path, 0.0, 1000.0,
               "m of the drive that a query of several scans reaches back");
    schema.add("query_spacing", config.query_spacing, 0.01, 100.0, "m between its scans, or");
    schema.add_degrees("query_angle_deg", config.query_angle, 0.1, 180.0, "between them");
    schema.add("search_every", config.search_every, 0.01, 100.0,
               "m driven between two searches while the place is unknown");
}

}  // namespace hybrid_slam
