// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>

#include "hybrid_slam/backend/g2o.hpp"
#include "hybrid_slam/core/error.hpp"
#include "input_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const hybrid_slam::fuzz::InputFile input(data, size);
    try {
        const hybrid_slam::G2oFile file = hybrid_slam::read_g2o(input.path());
        const std::size_t nodes = file.graph.nodes.size();
        bool consistent = nodes > 0 && file.ids.size() == nodes;
        for (const hybrid_slam::Edge& edge : file.graph.edges) {
            consistent = consistent && edge.from < nodes && edge.to < nodes;
        }
        if (!consistent) {
            std::abort();
        }
    } catch (const hybrid_slam::Error&) {
        // The one way to refuse a file.
    }
    return 0;
}
