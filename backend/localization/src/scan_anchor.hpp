// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid_slam/localization/reference_map.hpp"
#include "hybrid_slam/registration/icp.hpp"
#include "window_graph.hpp"

namespace hybrid_slam {

/// What one scan says of the pose in a map.
struct ScanAnchor {
    bool found = false;  ///< ICP came to an end
    double near = 0.0;   ///< share of the points near walls of the map at the anchor
    PoseAnchor anchor;   ///< by the scan alone; no information along what it does not determine
};

struct ScanAnchorConfig {
    double gate = 0.08;                ///< metres beyond the doubt of the pose, across a wall
    double translation_floor = 0.005;  ///< metres
    double rotation_floor = radians(0.05);
};

/// Finds what a scan (in the frame of the robot) says of the pose near `expected`. Points that no
/// wall of the map explains from there are left out before ICP looks at them: things that the map
/// does not have must not pull.
ScanAnchor anchor_of(const ReferenceMap& map, const Surface& scan, const PoseBelief& expected,
                     const ScanAnchorConfig& config, IcpConfig icp);

}  // namespace hybrid_slam
