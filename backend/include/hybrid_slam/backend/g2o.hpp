// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "hybrid_slam/backend/pose_graph.hpp"

namespace hybrid_slam {

/// A 2D pose graph as a .g2o file holds it: VERTEX_SE2, EDGE_SE2, EDGE_PRIOR_SE2 and FIX.
struct G2oFile {
    PoseGraph graph;
    std::vector<long> ids;          ///< id of each node in the file
    std::size_t skipped_lines = 0;  ///< records of kinds that we do not know
};

/// Reads plain text or gzip. Edges between successive ids are of kind kOdometry, all others
/// kClosure. Throws Error "file:line: ..." for a broken record, an edge to an unknown id or a
/// repeated vertex, and when there is no vertex at all.
G2oFile read_g2o(const std::filesystem::path& file);

/// Writes with enough digits to read the same doubles back; gzip when the name ends in .gz. Ids
/// default to the indices of the nodes.
void write_g2o(const std::filesystem::path& file, const PoseGraph& graph,
               const std::vector<long>& ids = {});

}  // namespace hybrid_slam
