// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>
#include <algorithm>
#include <functional>
#include <limits>
#include <queue>
#include <tuple>
#include <vector>

#include "hybrid_slam/backend/loop_closing.hpp"
#include "hybrid_slam/core/uncertainty.hpp"

namespace hybrid_slam {

namespace {

// One step of the graph as seen from the node where it is taken.
struct Step {
    std::size_t to = 0;
    Pose2d from_from_to;
    Eigen::Matrix3d covariance;  // of (x, y, heading) of from_from_to
};

std::vector<std::vector<Step>> steps_of(const PoseGraph& graph) {
    std::vector<std::vector<Step>> steps(graph.nodes.size());
    for (const Edge& edge : graph.edges) {
        const Eigen::Matrix3d covariance =
            turned(edge.information.inverse(), edge.from_from_to.rotation());
        steps[edge.from].push_back({edge.to, edge.from_from_to, covariance});
        steps[edge.to].push_back({edge.from, edge.from_from_to.inverse(),
                                  inverse_covariance(edge.from_from_to, covariance)});
    }
    return steps;
}

// Covariance of root_from_w after a step from v: heading errors swing the arm of the step.
Eigen::Matrix3d advanced(const Eigen::Matrix3d& covariance_v, double heading_v, const Step& step) {
    const Eigen::Matrix2d rotation = Pose2d(0.0, 0.0, heading_v).rotation();
    return swung(covariance_v, rotation * step.from_from_to.translation) +
           turned(step.covariance, rotation);
}

}  // namespace

std::vector<Eigen::Matrix3d> relative_uncertainties(const PoseGraph& graph, std::size_t node) {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    const auto steps = steps_of(graph);
    std::vector<Eigen::Matrix3d> seen_from_node(graph.nodes.size(),
                                                Eigen::Matrix3d::Constant(kFar));
    std::vector<double> costs(graph.nodes.size(), kFar);
    using Entry = std::tuple<double, std::size_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
    seen_from_node[node].setZero();
    costs[node] = 0.0;
    open.emplace(0.0, node);
    while (!open.empty()) {
        const auto [cost, v] = open.top();
        open.pop();
        if (cost > costs[v]) {
            continue;
        }
        const double heading = between(graph.nodes[node], graph.nodes[v]).heading;
        for (const Step& step : steps[v]) {
            const Eigen::Matrix3d covariance = advanced(seen_from_node[v], heading, step);
            const double next = std::max(cost, covariance.trace());
            if (next < costs[step.to]) {
                costs[step.to] = next;
                seen_from_node[step.to] = covariance;
                open.emplace(next, step.to);
            }
        }
    }
    for (std::size_t v = 0; v < graph.nodes.size(); ++v) {
        if (costs[v] < kFar) {
            seen_from_node[v] =
                inverse_covariance(between(graph.nodes[node], graph.nodes[v]), seen_from_node[v]);
        }
    }
    return seen_from_node;
}

Eigen::Matrix3d with_floor(const Eigen::Matrix3d& information, double translation,
                           double rotation) {
    Eigen::Matrix3d covariance = information.inverse();
    covariance(0, 0) += translation * translation;
    covariance(1, 1) += translation * translation;
    covariance(2, 2) += rotation * rotation;
    const Eigen::Matrix3d floored = covariance.inverse();
    return 0.5 * (floored + floored.transpose());
}

}  // namespace hybrid_slam
