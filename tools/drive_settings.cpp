// SPDX-License-Identifier: Apache-2.0
#include "drive_settings.hpp"

namespace hybrid_slam::tools {

void describe(ConfigSchema& schema, DriveSettings& settings) {
    describe(schema, settings.pilot);
    {
        const ConfigSchema::Section section(schema, "link");
        describe(schema, settings.link);
    }
    const ConfigSchema::Section section(schema, "fleet");
    describe(schema, settings.fleet);
}

DriveSettings load_drive_settings(const std::filesystem::path& file_or_empty,
                                  const Overrides& overrides) {
    DriveSettings settings;
    ConfigSchema schema;
    describe(schema, settings);
    if (!file_or_empty.empty()) {
        schema.load(file_or_empty);
    }
    override_with(schema, overrides);
    return settings;
}

std::string to_yaml(DriveSettings settings) {
    ConfigSchema schema;
    describe(schema, settings);
    return schema.to_yaml();
}

}  // namespace hybrid_slam::tools
