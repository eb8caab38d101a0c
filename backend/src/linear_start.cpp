// SPDX-License-Identifier: Apache-2.0
#include "linear_start.hpp"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <complex>

#include "unknowns.hpp"

namespace hybrid_slam {
namespace {

using Complex = std::complex<double>;

template <typename Scalar>
using Solver =
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<Scalar>, Eigen::Lower, Eigen::NaturalOrdering<int>>;

Complex rotation_of(double heading) {
    return {std::cos(heading), std::sin(heading)};
}

/// Minimises the sum of w |z_to - e^(i heading) z_from|^2 over complex numbers z, then brings each
/// back to the unit circle. False when the system is singular.
bool solve_rotations(const PoseGraph& graph, const Unknowns& unknowns,
                     std::vector<Complex>& rotations) {
    std::vector<Eigen::Triplet<Complex>> entries;
    entries.reserve(3 * graph.edges.size());
    Eigen::VectorXcd right = Eigen::VectorXcd::Zero(unknowns.count);
    for (const Edge& edge : graph.edges) {
        const int from = unknowns.place[edge.from];
        const int to = unknowns.place[edge.to];
        const double weight = edge.information(2, 2);
        const Complex turn = weight * rotation_of(edge.from_from_to.heading);
        if (from != kKnown) {
            entries.emplace_back(from, from, weight);
        }
        if (to != kKnown) {
            entries.emplace_back(to, to, weight);
        }
        if (from != kKnown && to != kKnown) {
            entries.emplace_back(std::max(from, to), std::min(from, to),
                                 to > from ? -turn : -std::conj(turn));
        } else if (from != kKnown) {
            right[from] += std::conj(turn) * rotations[edge.to];
        } else if (to != kKnown) {
            right[to] += turn * rotations[edge.from];
        }
    }
    Eigen::SparseMatrix<Complex> matrix(unknowns.count, unknowns.count);
    matrix.setFromTriplets(entries.begin(), entries.end());
    const Solver<Complex> solver(matrix);
    if (solver.info() != Eigen::Success) {
        return false;
    }
    const Eigen::VectorXcd solution = solver.solve(right);
    for (std::size_t node = 0; node < rotations.size(); ++node) {
        if (unknowns.place[node] != kKnown) {
            const Complex z = solution[unknowns.place[node]];
            rotations[node] = z / std::abs(z);
        }
    }
    return solution.allFinite() && solution.cwiseAbs().minCoeff() > 0.0;
}

/// Minimises the sum of the positions' part of chi2 with the rotations given; one 2 x 2 block of
/// the normal equations per node and per edge.
class PositionSystem {
  public:
    PositionSystem(const PoseGraph& graph, const Unknowns& unknowns)
        : graph_(graph), unknowns_(unknowns), right_(Eigen::VectorXd::Zero(2 * unknowns.count)) {
        entries_.reserve(12 * graph.edges.size());
    }

    void add(const Edge& edge, const Complex& rotation) {
        const int from = unknowns_.place[edge.from];
        const int to = unknowns_.place[edge.to];
        Eigen::Matrix2d turn;
        turn << rotation.real(), -rotation.imag(), rotation.imag(), rotation.real();
        const Eigen::Matrix2d to_axes = turn * edge.from_from_to.rotation();
        const Eigen::Matrix2d weight =
            to_axes * edge.information.topLeftCorner<2, 2>() * to_axes.transpose();
        Eigen::Vector2d step = turn * edge.from_from_to.translation;
        if (from != kKnown && to != kKnown) {
            add_block(std::max(from, to), std::min(from, to), -weight);
        } else if (from != kKnown) {
            step -= graph_.nodes[edge.to].translation;
        } else {
            step += graph_.nodes[edge.from].translation;
        }
        if (from != kKnown) {
            add_block(from, from, weight);
            right_.segment<2>(2 * from) -= weight * step;
        }
        if (to != kKnown) {
            add_block(to, to, weight);
            right_.segment<2>(2 * to) += weight * step;
        }
    }

    /// Empty when the system is singular.
    Eigen::VectorXd solve() const {
        Eigen::SparseMatrix<double> matrix(right_.size(), right_.size());
        matrix.setFromTriplets(entries_.begin(), entries_.end());
        const Solver<double> solver(matrix);
        if (solver.info() != Eigen::Success) {
            return {};
        }
        return solver.solve(right_);
    }

  private:
    void add_block(int row, int column, const Eigen::Matrix2d& block) {
        for (int i = 0; i < 2; ++i) {
            for (int j = 0; j < 2; ++j) {
                entries_.emplace_back(2 * row + i, 2 * column + j, block(i, j));
            }
        }
    }

    const PoseGraph& graph_;
    const Unknowns& unknowns_;
    std::vector<Eigen::Triplet<double>> entries_;
    Eigen::VectorXd right_;
};

}  // namespace

std::vector<Pose2d> linear_start(const PoseGraph& graph, const Gauge& gauge) {
    const Unknowns unknowns = number_unknowns(graph, gauge.held);
    std::vector<Complex> rotations;
    rotations.reserve(graph.nodes.size());
    for (const Pose2d& node : graph.nodes) {
        rotations.push_back(rotation_of(node.heading));
    }
    if (unknowns.count == 0 || !solve_rotations(graph, unknowns, rotations)) {
        return {};
    }
    PositionSystem positions(graph, unknowns);
    for (const Edge& edge : graph.edges) {
        const bool both_known =
            unknowns.place[edge.from] == kKnown && unknowns.place[edge.to] == kKnown;
        if (!both_known) {
            positions.add(edge, rotations[edge.from]);
        }
    }
    const Eigen::VectorXd solution = positions.solve();
    if (solution.size() == 0 || !solution.allFinite()) {
        return {};
    }
    std::vector<Pose2d> nodes = graph.nodes;
    for (std::size_t node = 0; node < nodes.size(); ++node) {
        const int place = unknowns.place[node];
        if (place != kKnown) {
            nodes[node] = {solution.segment<2>(2 * place), std::arg(rotations[node])};
        }
    }
    return nodes;
}

}  // namespace hybrid_slam
