// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "hybrid_slam/backend/pose_graph.hpp"

namespace hybrid_slam {

/// Throws Error for what no solver can use: an index without a node, a node joined to itself, a
/// measurement that is not finite, an information that is not symmetric positive semidefinite.
void check(const PoseGraph& graph);

/// What ties each node down. Nodes joined by edges (of any information but zero) are one part.
struct Gauge {
    std::vector<std::size_t> part;  ///< of each node: the lowest index of a node joined with it
    std::vector<bool> anchored;     ///< of each node: its part holds a fixed node or a prior
    std::vector<bool> held;         ///< of each node: fixed, or the first of a part not anchored
};
Gauge find_gauge(const PoseGraph& graph);

}  // namespace hybrid_slam
