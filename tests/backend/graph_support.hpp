// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "hybrid_slam/backend/pose_graph.hpp"

namespace hybrid_slam::test {

/// Draws of one seed, for graphs that are the same on every run.
class Random {
  public:
    explicit Random(unsigned seed) : engine_(seed) {}

    double uniform(double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(engine_);
    }
    double normal(double sigma) { return std::normal_distribution<double>(0.0, sigma)(engine_); }
    std::size_t index(std::size_t count) {
        return std::uniform_int_distribution<std::size_t>(0, count - 1)(engine_);
    }
    Pose2d pose(double metres) {
        const double x = uniform(-metres, metres);
        const double y = uniform(-metres, metres);
        return {x, y, uniform(-kPi, kPi)};
    }
    /// Positive definite, with every entry off the diagonal at work.
    Eigen::Matrix3d information() {
        Eigen::Matrix3d root;
        for (int i = 0; i < 9; ++i) {
            root(i / 3, i % 3) = uniform(-1.0, 1.0);
        }
        const Eigen::Vector3d scale(10.0, 20.0, 30.0);
        const Eigen::Matrix3d information =
            scale.asDiagonal() * (root * root.transpose() + 0.1 * Eigen::Matrix3d::Identity()) *
            scale.asDiagonal();
        return information.selfadjointView<Eigen::Upper>();  // symmetric to the last bit
    }

  private:
    std::mt19937 engine_;
};

inline Edge edge_between(std::size_t from, std::size_t to, const Pose2d& from_from_to) {
    Edge edge;
    edge.from = from;
    edge.to = to;
    edge.from_from_to = from_from_to;
    edge.kind = to == from + 1 ? EdgeKind::kOdometry : EdgeKind::kClosure;
    return edge;
}

/// A chain of `size` nodes with closures, measured with a little noise and correlated information;
/// the nodes are the truth.
inline PoseGraph random_graph(unsigned seed, std::size_t size, std::size_t closures) {
    Random random(seed);
    PoseGraph graph;
    graph.nodes.push_back(random.pose(1.0));
    for (std::size_t i = 1; i < size; ++i) {
        const Pose2d step(1.0, random.uniform(-0.3, 0.3), random.uniform(-1.0, 1.0));
        graph.nodes.push_back(graph.nodes.back() * step);
    }
    const auto add = [&](std::size_t from, std::size_t to) {
        const Pose2d noise(random.normal(0.02), random.normal(0.02), random.normal(0.02));
        Edge edge = edge_between(from, to, between(graph.nodes[from], graph.nodes[to]) * noise);
        edge.information = random.information();
        graph.edges.push_back(edge);
    };
    for (std::size_t i = 0; i + 1 < size; ++i) {
        add(i, i + 1);
    }
    for (std::size_t i = 0; i < closures; ++i) {
        const std::size_t from = random.index(size);
        add(from, (from + 2 + random.index(size - 3)) % size);
    }
    return graph;
}

/// A walk along the streets of a square town, with closures wherever it comes by again, measured
/// with the given noise. The nodes are the odometry chain.
inline PoseGraph town_walk(unsigned seed, std::size_t size, double metres, double angle) {
    Random random(seed);
    std::vector<Pose2d> truth(1);
    while (truth.size() < size) {
        const bool at_corner = truth.size() % 4 == 0;
        const double turn = at_corner ? (random.uniform(0.0, 1.0) < 0.5 ? 0.5 : -0.5) * kPi : 0.0;
        truth.push_back(truth.back() * Pose2d(1.0, 0.0, turn));
    }
    PoseGraph graph;
    const auto add = [&](std::size_t from, std::size_t to) {
        const Pose2d noise(random.normal(metres), random.normal(metres), random.normal(angle));
        Edge edge = edge_between(from, to, between(truth[from], truth[to]) * noise);
        edge.information =
            Eigen::Vector3d(1.0 / metres / metres, 1.0 / metres / metres, 1.0 / angle / angle)
                .asDiagonal();
        graph.edges.push_back(edge);
    };
    for (std::size_t to = 1; to < size; ++to) {
        add(to - 1, to);
        for (std::size_t from = 0; from + 8 < to; ++from) {
            if ((truth[from].translation - truth[to].translation).norm() < 0.5) {
                add(from, to);
            }
        }
    }
    graph.nodes.emplace_back();
    for (const Edge& edge : graph.edges) {
        if (edge.kind == EdgeKind::kOdometry) {
            graph.nodes.push_back(graph.nodes.back() * edge.from_from_to);
        }
    }
    return graph;
}

/// Residuals, derivatives and normal equations without any of the library's machinery: numeric
/// derivatives by right perturbations of all nodes but those held, and dense matrices.
class DenseOracle {
  public:
    DenseOracle(const PoseGraph& graph, std::vector<std::size_t> held)
        : graph_(graph), held_(std::move(held)) {}

    Eigen::MatrixXd information() const {
        const Eigen::MatrixXd jacobian = this->jacobian();
        const Eigen::Index size = jacobian.cols();
        Eigen::MatrixXd normal = jacobian.transpose() * weights() * jacobian;
        for (const std::size_t node : held_) {
            const Eigen::Index at = 3 * static_cast<Eigen::Index>(node);
            normal.middleRows(at, 3).setZero();
            normal.middleCols(at, 3).setZero();
            normal.block<3, 3>(at, at).setIdentity();
        }
        return normal.topLeftCorner(size, size);
    }

    /// Gauss-Newton steps; the graph's nodes must lie near the optimum.
    void optimize(int steps) {
        for (int i = 0; i < steps; ++i) {
            Eigen::VectorXd right = -(jacobian().transpose() * weights() * residuals());
            for (const std::size_t node : held_) {
                right.segment<3>(3 * static_cast<Eigen::Index>(node)).setZero();
            }
            const Eigen::VectorXd step = information().ldlt().solve(right);
            for (std::size_t node = 0; node < graph_.nodes.size(); ++node) {
                const auto at = 3 * static_cast<Eigen::Index>(node);
                graph_.nodes[node] =
                    graph_.nodes[node] * Pose2d(step[at], step[at + 1], step[at + 2]);
            }
        }
    }

    const PoseGraph& graph() const { return graph_; }

  private:
    Eigen::VectorXd residuals() const {
        Eigen::VectorXd all(3 * (graph_.edges.size() + graph_.priors.size()));
        Eigen::Index at = 0;
        for (const Edge& edge : graph_.edges) {
            const Pose2d found = graph_.nodes[edge.from].inverse() * graph_.nodes[edge.to];
            all.segment<3>(at) = (edge.from_from_to.inverse() * found).vector();
            at += 3;
        }
        for (const Prior& prior : graph_.priors) {
            all.segment<3>(at) =
                (prior.map_from_node.inverse() * graph_.nodes[prior.node]).vector();
            at += 3;
        }
        return all;
    }

    Eigen::MatrixXd weights() const {
        const auto size = 3 * static_cast<Eigen::Index>(graph_.edges.size() + graph_.priors.size());
        Eigen::MatrixXd all = Eigen::MatrixXd::Zero(size, size);
        Eigen::Index at = 0;
        for (const Edge& edge : graph_.edges) {
            all.block<3, 3>(at, at) = edge.information;
            at += 3;
        }
        for (const Prior& prior : graph_.priors) {
            all.block<3, 3>(at, at) = prior.information;
            at += 3;
        }
        return all;
    }

    Eigen::MatrixXd jacobian() const {
        constexpr double kStep = 1e-6;
        const Eigen::Index rows = residuals().size();
        Eigen::MatrixXd all(rows, 3 * static_cast<Eigen::Index>(graph_.nodes.size()));
        DenseOracle moved = *this;
        for (Eigen::Index column = 0; column < all.cols(); ++column) {
            const auto node = static_cast<std::size_t>(column / 3);
            Eigen::Vector3d step = Eigen::Vector3d::Zero();
            step[column % 3] = kStep;
            const auto shifted = [&](double sign) {
                moved.graph_.nodes[node] =
                    graph_.nodes[node] * Pose2d(sign * step.x(), sign * step.y(), sign * step.z());
                return moved.residuals();
            };
            all.col(column) = (shifted(1.0) - shifted(-1.0)) / (2.0 * kStep);
            moved.graph_.nodes[node] = graph_.nodes[node];
        }
        return all;
    }

    PoseGraph graph_;
    std::vector<std::size_t> held_;
};

}  // namespace hybrid_slam::test
