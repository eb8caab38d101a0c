// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>

#include "edge_cost.hpp"
#include "gauge.hpp"
#include "hybrid_slam/backend/pose_graph.hpp"
#include "hybrid_slam/core/error.hpp"
#include "unknowns.hpp"

namespace hybrid_slam {
namespace {

using Block = Eigen::Matrix3d;
using Columns = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// The Gauss-Newton information of the nodes that are not known, H = sum of J^T Omega J, as L D
/// L^T.
class Factor {
  public:
    Factor(const PoseGraph& graph, const std::vector<bool>& known)
        : unknowns_(number_unknowns(graph, known)) {
        entries_.reserve(27 * graph.edges.size());
        for (const Edge& edge : graph.edges) {
            add(edge, linearize(edge.from_from_to, graph.nodes[edge.from], graph.nodes[edge.to]));
        }
        for (const Prior& prior : graph.priors) {
            const LinearizedEdge linear =
                linearize(prior.map_from_node, Pose2d(), graph.nodes[prior.node]);
            add_block(unknowns_.place[prior.node], unknowns_.place[prior.node],
                      linear.by_to.transpose() * prior.information * linear.by_to);
        }
        factorize();
    }

    /// L^-1 times the columns of one node, of which D-weighted products are covariances: with
    /// H = L D L^T, the block (a, b) of its inverse is (L^-1 E_a)^T D^-1 (L^-1 E_b).
    Columns half(std::size_t node) const {
        Columns columns = Columns::Zero(3 * unknowns_.count, 3);
        const int place = unknowns_.place[node];
        if (place != kKnown) {
            columns.middleRows<3>(3 * place).setIdentity();
            solver_.matrixL().solveInPlace(columns);
        }
        return columns;
    }

    Block covariance(const Columns& a, const Columns& b) const {
        return a.transpose() * inverse_pivots_.asDiagonal() * b;
    }

  private:
    void add(const Edge& edge, const LinearizedEdge& linear) {
        const int from = unknowns_.place[edge.from];
        const int to = unknowns_.place[edge.to];
        const Block weighted_from = linear.by_from.transpose() * edge.information;
        const Block weighted_to = linear.by_to.transpose() * edge.information;
        add_block(from, from, weighted_from * linear.by_from);
        add_block(to, to, weighted_to * linear.by_to);
        if (from > to) {
            add_block(from, to, weighted_from * linear.by_to);
        } else {
            add_block(to, from, weighted_to * linear.by_from);
        }
    }

    void add_block(int row, int column, const Block& block) {
        if (row == kKnown || column == kKnown) {
            return;
        }
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                entries_.emplace_back(3 * row + i, 3 * column + j, block(i, j));
            }
        }
    }

    void factorize() {
        // Rounding leaves about 1e-15 of its diagonal entry in the pivot of an undetermined
        // direction.
        constexpr double kLeastPivot = 1e-12;
        Eigen::SparseMatrix<double> information(3 * unknowns_.count, 3 * unknowns_.count);
        information.setFromTriplets(entries_.begin(), entries_.end());
        solver_.compute(information);
        const Eigen::VectorXd least = kLeastPivot * information.diagonal();
        if (solver_.info() != Eigen::Success ||
            !(solver_.vectorD().array() > least.array()).all()) {
            throw Error("pose graph: its edges and priors do not determine the covariance");
        }
        inverse_pivots_ = solver_.vectorD().cwiseInverse();
    }

    Unknowns unknowns_;
    std::vector<Eigen::Triplet<double>> entries_;
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::NaturalOrdering<int>>
        solver_;
    Eigen::VectorXd inverse_pivots_;
};

void check_named(const PoseGraph& graph, std::size_t node) {
    if (node >= graph.nodes.size()) {
        throw Error(fmt::format("pose graph: the covariance is asked of node {} of {}", node,
                                graph.nodes.size()));
    }
}

/// Held nodes and those whose parts are not asked for: the factor leaves both out.
std::vector<bool> known_besides(const Gauge& gauge, const std::vector<std::size_t>& asked) {
    std::vector<bool> part_asked(gauge.part.size(), false);
    for (const std::size_t node : asked) {
        part_asked[gauge.part[node]] = true;
    }
    std::vector<bool> known = gauge.held;
    for (std::size_t node = 0; node < known.size(); ++node) {
        known[node] = known[node] || !part_asked[gauge.part[node]];
    }
    return known;
}

}  // namespace

Eigen::Matrix3d relative_covariance(const PoseGraph& graph, std::size_t reference,
                                    std::size_t node) {
    check(graph);
    check_named(graph, reference);
    check_named(graph, node);
    const Gauge gauge = find_gauge(graph);
    const bool joined = gauge.part[reference] == gauge.part[node];
    if (!joined && !(gauge.anchored[reference] && gauge.anchored[node])) {
        throw Error(fmt::format("pose graph: nothing ties node {} to node {}", node, reference));
    }
    const Factor factor(graph, known_besides(gauge, {reference, node}));
    const Columns a = factor.half(reference);
    const Columns b = factor.half(node);
    const LinearizedEdge pose = linearize(Pose2d(), graph.nodes[reference], graph.nodes[node]);
    const Columns both = a * pose.by_from.transpose() + b * pose.by_to.transpose();
    return factor.covariance(both, both);
}

std::vector<Eigen::Matrix3d> marginal_covariances(const PoseGraph& graph,
                                                  const std::vector<std::size_t>& nodes) {
    check(graph);
    const Gauge gauge = find_gauge(graph);
    const bool floating = graph.fixed.empty() && graph.priors.empty();
    for (const std::size_t node : nodes) {
        check_named(graph, node);
        const bool tied = gauge.anchored[node] || (floating && gauge.part[node] == 0);
        if (!tied) {
            throw Error(fmt::format("pose graph: nothing ties node {} to the map", node));
        }
    }
    const Factor factor(graph, known_besides(gauge, nodes));
    std::vector<Eigen::Matrix3d> covariances;
    covariances.reserve(nodes.size());
    for (const std::size_t node : nodes) {
        const Columns half = factor.half(node);
        covariances.push_back(factor.covariance(half, half));
    }
    return covariances;
}

}  // namespace hybrid_slam
