// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "hybrid_slam/vision/visual_source.hpp"
#include "input.hpp"
#include "settings.hpp"

namespace hybrid_slam::tools {

/// The input with visual odometry in place of its images; the input itself when it has none.
std::unique_ptr<Input> with_vision(std::unique_ptr<Input> input, const VisionConfig& config);

/// Throws Error for a camera that cannot be and for a network that cannot be used.
VisualOdometry visual_odometry_of(const CameraConfig& camera, const VisionConfig& config);

nlohmann::ordered_json to_json(const VisualCounts& counts);
std::vector<std::string> warnings_of(const VisualCounts& counts);

}  // namespace hybrid_slam::tools
