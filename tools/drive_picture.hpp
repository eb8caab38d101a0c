// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "figure.hpp"
#include "hybrid_slam/core/trajectory.hpp"
#include "hybrid_slam/localization/reference_map.hpp"
#include "hybrid_slam/vehicle/planner.hpp"

namespace hybrid_slam::tools {

/// What was planned and what was driven, over the map.
struct DrivePicture {
    std::string title;
    std::string subtitle;
    const ReferenceMap& map;
    const VehicleConfig& vehicle;
    const std::vector<Route>& routes;
    const Trajectory& driven;          ///< poses as SLAM told them
    const std::vector<Pose2d>& stood;  ///< at the start, and where it arrived
    const std::vector<Pose2d>& stops;  ///< on the way
};
Canvas draw(const DrivePicture& picture);

}  // namespace hybrid_slam::tools
