// SPDX-License-Identifier: Apache-2.0
#include <hybrid_slam/backend/pose_graph.hpp>
#include <iostream>

int main() {
    // A square driven once; the last edge says that the way ends where it began.
    hybrid_slam::PoseGraph graph;
    const hybrid_slam::Pose2d side(1.0, 0.0, hybrid_slam::kPi / 2);
    graph.nodes.resize(4);
    for (std::size_t i = 0; i < 4; ++i) {
        graph.edges.push_back({i, (i + 1) % 4, side});
    }
    const hybrid_slam::OptimizeSummary summary = optimize(graph);
    std::cout << summary.message << ", chi2 " << summary.initial_chi2 << " -> "
              << summary.final_chi2 << '\n';
    return summary.usable && summary.final_chi2 < 1e-9 ? 0 : 1;
}
