// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "fleet_port.hpp"
#include "hybrid_slam/link/link_server.hpp"
#include "hybrid_slam/pilot/pilot.hpp"
#include "settings.hpp"

namespace hybrid_slam::tools {

/// Everything that a configuration file of `drive` can say.
struct DriveSettings {
    PilotConfig pilot;      ///< with planner.* and follower.*
    LinkServerConfig link;  ///< who may connect
    FleetConfig fleet;
};

void describe(ConfigSchema& schema, DriveSettings& settings);

/// Throws Error that names the key, and the line when it stands in a file.
DriveSettings load_drive_settings(const std::filesystem::path& file_or_empty,
                                  const Overrides& overrides);
std::string to_yaml(DriveSettings settings);

}  // namespace hybrid_slam::tools
