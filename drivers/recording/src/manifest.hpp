// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "hybrid_slam/recording/recording.hpp"

namespace hybrid_slam {

inline constexpr int kRecordingVersion = 1;

/// As JSON.
std::string to_text(const RecordingManifest& manifest);

/// What the manifest says; as if it were not closed where it is missing or torn. Throws Error for
/// one of another program and for a newer version.
RecordingManifest read_manifest(const std::filesystem::path& folder);

/// "2024-05-31T12:00:00Z", of now.
std::string utc_now();

}  // namespace hybrid_slam
