// SPDX-License-Identifier: Apache-2.0
#include "gauge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <string>

#include "edge_cost.hpp"
#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

/// One record of a graph, as an error names it.
struct Record {
    const char* kind;
    std::size_t index;

    [[noreturn]] void refuse(const std::string& why) const {
        throw Error(fmt::format("pose graph: {} {} {}", kind, index, why));
    }
};

void check_node(const PoseGraph& graph, std::size_t node, const Record& record) {
    if (node >= graph.nodes.size()) {
        record.refuse(fmt::format("names node {} of {}", node, graph.nodes.size()));
    }
}

void check_measurement(const Pose2d& pose, const Eigen::Matrix3d& information,
                       const Record& record) {
    if (!pose.vector().allFinite()) {
        record.refuse("has a measurement that is not finite");
    }
    if (!is_semidefinite(information)) {
        record.refuse("has an information that is not symmetric positive semidefinite");
    }
}

/// Follows links to the lowest index of a part, halving the path on the way (disjoint sets).
std::size_t find_root(std::vector<std::size_t>& part, std::size_t node) {
    while (part[node] != node) {
        part[node] = part[part[node]];
        node = part[node];
    }
    return node;
}

}  // namespace

void check(const PoseGraph& graph) {
    for (std::size_t i = 0; i < graph.edges.size(); ++i) {
        const Edge& edge = graph.edges[i];
        const Record record{"edge", i};
        check_node(graph, edge.from, record);
        check_node(graph, edge.to, record);
        if (edge.from == edge.to) {
            record.refuse(fmt::format("joins node {} to itself", edge.from));
        }
        check_measurement(edge.from_from_to, edge.information, record);
    }
    for (std::size_t i = 0; i < graph.priors.size(); ++i) {
        const Prior& prior = graph.priors[i];
        check_node(graph, prior.node, {"prior", i});
        check_measurement(prior.map_from_node, prior.information, {"prior", i});
    }
    for (std::size_t i = 0; i < graph.fixed.size(); ++i) {
        check_node(graph, graph.fixed[i], {"fixed entry", i});
    }
}

Gauge find_gauge(const PoseGraph& graph) {
    const std::size_t size = graph.nodes.size();
    Gauge gauge;
    gauge.part.resize(size);
    std::iota(gauge.part.begin(), gauge.part.end(), std::size_t{0});
    for (const Edge& edge : graph.edges) {
        if (!edge.information.isZero(0.0)) {
            const std::size_t a = find_root(gauge.part, edge.from);
            const std::size_t b = find_root(gauge.part, edge.to);
            gauge.part[std::max(a, b)] = std::min(a, b);
        }
    }
    std::vector<bool> part_anchored(size, false);
    gauge.held.assign(size, false);
    for (const std::size_t node : graph.fixed) {
        gauge.held[node] = true;
        part_anchored[find_root(gauge.part, node)] = true;
    }
    for (const Prior& prior : graph.priors) {
        if (!prior.information.isZero(0.0)) {
            part_anchored[find_root(gauge.part, prior.node)] = true;
        }
    }
    gauge.anchored.resize(size);
    for (std::size_t node = 0; node < size; ++node) {
        gauge.part[node] = find_root(gauge.part, node);
        gauge.anchored[node] = part_anchored[gauge.part[node]];
        if (gauge.part[node] == node && !gauge.anchored[node]) {
            gauge.held[node] = true;
        }
    }
    return gauge;
}

}  // namespace hybrid_slam
