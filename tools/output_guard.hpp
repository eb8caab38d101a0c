// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

namespace hybrid_slam::tools {

/// Whether the folder is that of a map or a recording.
bool is_map_or_recording(const std::filesystem::path& folder);

/// Before the work, so that nobody loses what is not ours or a file of a map. Throws Error when
/// `file` lies in the folder of a map or a recording, or is there and does not begin with `magic`.
void expect_replaceable(const std::filesystem::path& file, std::string_view magic);

}  // namespace hybrid_slam::tools
