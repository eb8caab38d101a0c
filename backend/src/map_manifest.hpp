// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "map_files.hpp"

namespace hybrid_slam {

/// Null when there is none, or that of someone else.
nlohmann::json manifest_in(const std::filesystem::path& folder);

/// What only the manifest can tell: is it ours, can we read it, is it whole. Throws Error.
nlohmann::json read_map_manifest(const std::filesystem::path& folder);

/// Sizes and CRC-32 of all files that it lists. Throws Error that names the file.
void check_files(const std::filesystem::path& folder, const nlohmann::json& manifest);

[[noreturn]] void fail_damaged(const std::filesystem::path& place, const std::string& why);
/// Members of the manifest at `place`. Both throw Error when there is no such thing.
const nlohmann::json& member(const std::filesystem::path& place, const nlohmann::json& object,
                             const char* key);
std::uint64_t count_of(const std::filesystem::path& place, const nlohmann::json& object,
                       const char* key);

}  // namespace hybrid_slam
