// SPDX-License-Identifier: Apache-2.0
// Optimises anybody's 2D pose graph: 03_optimize_g2o IN.g2o OUT.g2o
#include <exception>
#include <iostream>

#include "hybrid_slam/backend/g2o.hpp"

int main(int argc, char** argv) {
    if (argc != 3) {
        std::cerr << "usage: 03_optimize_g2o IN.g2o OUT.g2o\n";
        return 2;
    }
    try {
        hybrid_slam::G2oFile file = hybrid_slam::read_g2o(argv[1]);
        const hybrid_slam::OptimizeSummary summary = optimize(file.graph);
        std::cout << file.graph.nodes.size() << " nodes, " << file.graph.edges.size()
                  << " edges: chi2 " << summary.initial_chi2 << " -> " << summary.final_chi2
                  << " in " << summary.solve_seconds << " s\n";
        hybrid_slam::write_g2o(argv[2], file.graph, file.ids);
        return summary.usable ? 0 : 1;
    } catch (const std::exception& error) {
        std::cerr << "03_optimize_g2o: " << error.what() << '\n';
        return 1;
    }
}
