// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "canvas.hpp"
#include "hybrid_slam/core/measurements.hpp"
#include "inspection.hpp"

namespace hybrid_slam::tools {

/// Images at evenly spaced places of a recording, as many as can be read; the stamp is the arrival.
std::vector<Image> read_thumbnails(const std::filesystem::path& recording, std::size_t count);

/// A strip of images over a strip of what the lidar saw, each with the time since the beginning.
Canvas draw_strip(const std::string& title, const Inspection& inspection,
                  const std::vector<Image>& images);

}  // namespace hybrid_slam::tools
