// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hybrid_slam/core/measurements.hpp"

namespace hybrid_slam::tools {

/// One scan as JSON, see docs/formats.md. Throws Error that names the file and the key for all that
/// is not exactly such a file.
Scan read_scan(const std::filesystem::path& file);

/// What read_scan gives back to the last bit, but for flags and the times of single beams. Throws
/// Error when the file cannot be written.
void write_scan(const std::filesystem::path& file, const Scan& scan);

}  // namespace hybrid_slam::tools
