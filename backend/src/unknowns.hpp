// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hybrid_slam/backend/pose_graph.hpp"

namespace hybrid_slam {

inline constexpr int kKnown = -1;

/// The place of each node among the unknowns of a sparse system, kKnown for none. Numbered in an
/// order of elimination that keeps Cholesky factors sparse, so that solvers take it as it is.
struct Unknowns {
    std::vector<int> place;
    int count = 0;
};
Unknowns number_unknowns(const PoseGraph& graph, const std::vector<bool>& known);

}  // namespace hybrid_slam
