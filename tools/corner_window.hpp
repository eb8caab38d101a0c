// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "hybrid_slam/core/camera_model.hpp"
#include "hybrid_slam/core/measurements.hpp"

namespace hybrid_slam::tools {

/// The four corners that the user clicks in a window. The window is a program of its own,
/// hybrid-slam-window: OpenCV's would cost every start of this one 35 ms and 9 MB, and end it where
/// there is no display. Throws Error when there is no window, and when the user gives up.
std::vector<Pixel> pick_corners(const Image& image);

/// The same by the program named, which takes "width height channels\n" and the pixels from its
/// standard input and prints "u v" for each corner; exits with 0, or with 3 when the user gives up.
std::vector<Pixel> pick_corners_by(const std::filesystem::path& program, const Image& image);

}  // namespace hybrid_slam::tools
