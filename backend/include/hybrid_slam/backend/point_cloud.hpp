// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hybrid_slam/core/points.hpp"

namespace hybrid_slam {

/// Points on the plane z = 0 as ASCII files of 0.1 mm that viewers read. Both throw Error when the
/// file cannot be written.
void write_ply(const std::filesystem::path& file, const Points& points);
void write_pcd(const std::filesystem::path& file, const Points& points);  ///< PCD 0.7, of PCL

}  // namespace hybrid_slam
