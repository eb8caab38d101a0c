// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gauge.hpp"
#include "hybrid_slam/backend/pose_graph.hpp"

namespace hybrid_slam {

/// Nodes from two linear least squares problems, rotations first and then positions, that need no
/// guess (Carlone et al., "Initialization techniques for 3D SLAM", ICRA 2015, in the plane). Held
/// nodes stay. Empty when the edges do not determine one of the two. Priors are not looked at.
std::vector<Pose2d> linear_start(const PoseGraph& graph, const Gauge& gauge);

}  // namespace hybrid_slam
