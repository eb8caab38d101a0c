// SPDX-License-Identifier: Apache-2.0
#include "unknowns.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

namespace hybrid_slam {

Unknowns number_unknowns(const PoseGraph& graph, const std::vector<bool>& known) {
    Unknowns unknowns;
    unknowns.place.assign(graph.nodes.size(), kKnown);
    for (std::size_t node = 0; node < graph.nodes.size(); ++node) {
        if (!known[node]) {
            unknowns.place[node] = unknowns.count++;
        }
    }
    std::vector<Eigen::Triplet<float>> entries;
    entries.reserve(2 * graph.edges.size() + graph.nodes.size());
    for (int place = 0; place < unknowns.count; ++place) {
        entries.emplace_back(place, place,
                             1.0F);  // without one, the ordering takes a row for dense
    }
    for (const Edge& edge : graph.edges) {
        const int from = unknowns.place[edge.from];
        const int to = unknowns.place[edge.to];
        if (from != kKnown && to != kKnown) {
            entries.emplace_back(from, to, 1.0F);
            entries.emplace_back(to, from, 1.0F);
        }
    }
    Eigen::SparseMatrix<float> pattern(unknowns.count, unknowns.count);
    pattern.setFromTriplets(entries.begin(), entries.end());
    Eigen::AMDOrdering<int>::PermutationType place_in_order;
    Eigen::AMDOrdering<int>()(pattern, place_in_order);
    const Eigen::AMDOrdering<int>::PermutationType order = place_in_order.inverse();
    for (int& place : unknowns.place) {
        place = place == kKnown ? kKnown : order.indices()[place];
    }
    return unknowns;
}

}  // namespace hybrid_slam
