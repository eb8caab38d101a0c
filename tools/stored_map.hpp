// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "hybrid_slam/localization/reference_map.hpp"

namespace hybrid_slam::tools {

/// What the program puts into a map folder beside the map itself.
struct MapExtras {
    static constexpr auto kConfig = "config.yaml";
    static constexpr auto kSummary = "summary.json";
};

/// Reads the map folder that a command was given. Throws Error as read_map does; of a recording, a
/// log or a map_server map it says what that is, and what it is good for.
StoredMap open_map_folder(const std::filesystem::path& path);

/// Reads a map of either kind to localize in, likewise.
std::shared_ptr<const ReferenceMap> open_reference_map(const std::filesystem::path& path);

/// The name of the drive that a map was made of, when its summary tells.
std::string drive_of(const std::filesystem::path& map);

}  // namespace hybrid_slam::tools
