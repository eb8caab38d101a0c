// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "graph_support.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

using test::DenseOracle;
using test::error_of;
using test::Random;
using test::random_graph;
using ::testing::HasSubstr;

Eigen::Matrix3d block(const Eigen::MatrixXd& matrix, std::size_t row, std::size_t column) {
    return matrix.block<3, 3>(3 * static_cast<Eigen::Index>(row),
                              3 * static_cast<Eigen::Index>(column));
}

PoseGraph graph_with_prior(unsigned seed) {
    Random random(seed + 100);
    PoseGraph graph = random_graph(seed, 12, 6);
    Prior prior;
    prior.node = 3;
    prior.map_from_node = graph.nodes[3] * Pose2d(0.1, -0.1, 0.05);
    prior.information = random.information();
    graph.priors.push_back(prior);
    return graph;
}

TEST(MarginalCovariances, AreTheBlocksOfTheDenseInverse) {
    PoseGraph graph = random_graph(1, 12, 6);
    graph.fixed = {4};
    const Eigen::MatrixXd inverse = DenseOracle(graph, {4}).information().inverse();
    const std::vector<std::size_t> nodes{11, 0, 7, 3};
    const auto covariances = marginal_covariances(graph, nodes);
    ASSERT_EQ(covariances.size(), nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        EXPECT_TRUE(covariances[i].isApprox(block(inverse, nodes[i], nodes[i]), 1e-6));
    }
    EXPECT_TRUE(marginal_covariances(graph, {4}).front().isZero(0.0));
}

TEST(MarginalCovariances, TakePriorsAndSemidefiniteEdges) {
    PoseGraph graph = graph_with_prior(2);
    const Eigen::Vector3d direction(1.0, 2.0, 3.0);
    graph.edges.back().information = direction * direction.transpose();
    const Eigen::MatrixXd inverse = DenseOracle(graph, {}).information().inverse();
    for (std::size_t node = 0; node < graph.nodes.size(); ++node) {
        const Eigen::Matrix3d covariance = marginal_covariances(graph, {node}).front();
        EXPECT_TRUE(covariance.isApprox(block(inverse, node, node), 1e-6)) << node;
    }
}

TEST(RelativeCovariance, IsThatOfTheDenseInverse) {
    const PoseGraph graph = graph_with_prior(3);
    const Eigen::MatrixXd inverse = DenseOracle(graph, {}).information().inverse();
    const std::size_t a = 9;
    const std::size_t b = 2;
    // By numeric derivatives of the pose of b seen from a.
    Eigen::Matrix<double, 3, 6> jacobian;
    for (int i = 0; i < 6; ++i) {
        Eigen::Vector3d step = Eigen::Vector3d::Zero();
        step[i % 3] = 1e-6;
        const Pose2d small(step.x(), step.y(), step.z());
        const Pose2d from = i < 3 ? graph.nodes[a] * small : graph.nodes[a];
        const Pose2d to = i < 3 ? graph.nodes[b] : graph.nodes[b] * small;
        const Eigen::Vector3d moved = between(from, to).vector();
        jacobian.col(i) = (moved - between(graph.nodes[a], graph.nodes[b]).vector()) / 1e-6;
    }
    Eigen::Matrix<double, 6, 6> joint;
    joint << block(inverse, a, a), block(inverse, a, b), block(inverse, b, a), block(inverse, b, b);
    const Eigen::Matrix3d expected = jacobian * joint * jacobian.transpose();
    EXPECT_TRUE(relative_covariance(graph, a, b).isApprox(expected, 1e-4));
}

TEST(RelativeCovariance, OfOneEdgeIsItsOwn) {
    Random random(4);
    PoseGraph graph;
    graph.nodes = {random.pose(5.0), random.pose(5.0)};
    Edge edge = test::edge_between(0, 1, between(graph.nodes[0], graph.nodes[1]));
    edge.information = random.information();
    graph.edges = {edge};
    // The residual is in the axes of `to`, the covariance in those of the reference.
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    turn.topLeftCorner<2, 2>() = edge.from_from_to.rotation();
    const Eigen::Matrix3d expected = turn * edge.information.inverse() * turn.transpose();
    EXPECT_TRUE(relative_covariance(graph, 0, 1).isApprox(expected, 1e-9));
}

TEST(RelativeCovariance, DoesNotDependOnTheNodeHeld) {
    PoseGraph graph = random_graph(5, 15, 5);
    const Eigen::Matrix3d floating = relative_covariance(graph, 10, 3);
    graph.fixed = {7};
    EXPECT_TRUE(relative_covariance(graph, 10, 3).isApprox(floating, 1e-7));
    EXPECT_TRUE(relative_covariance(graph, 3, 3).isZero(1e-15));
    graph.fixed = {10};
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    turn.topLeftCorner<2, 2>() = between(graph.nodes[10], graph.nodes[3]).rotation();
    const Eigen::Matrix3d marginal = marginal_covariances(graph, {3}).front();
    EXPECT_TRUE((turn * marginal * turn.transpose()).isApprox(floating, 1e-7));
}

TEST(RelativeCovariance, GrowsAlongAChainAndAClosureShrinksIt) {
    PoseGraph chain;
    chain.nodes.emplace_back();
    for (std::size_t i = 0; i < 20; ++i) {
        chain.nodes.emplace_back(static_cast<double>(i + 1), 0.0, 0.0);
        chain.edges.push_back(test::edge_between(i, i + 1, {1.0, 0.0, 0.0}));
    }
    double last = 0.0;
    for (std::size_t i = 1; i <= 20; ++i) {
        const double trace = relative_covariance(chain, 0, i).trace();
        EXPECT_GT(trace, last);
        last = trace;
    }
    chain.edges.push_back(test::edge_between(0, 20, {20.0, 0.0, 0.0}));
    EXPECT_LT(relative_covariance(chain, 0, 20).trace(), 0.1 * last);
}

/// Two chains without an edge between them.
PoseGraph two_parts() {
    PoseGraph graph = random_graph(6, 6, 2);
    const PoseGraph other = random_graph(7, 5, 2);
    for (Edge edge : other.edges) {
        edge.from += graph.nodes.size();
        edge.to += graph.nodes.size();
        graph.edges.push_back(edge);
    }
    graph.nodes.insert(graph.nodes.end(), other.nodes.begin(), other.nodes.end());
    return graph;
}

TEST(Covariance, NeedsATieBetweenTheNodes) {
    PoseGraph graph = two_parts();
    EXPECT_NO_THROW(relative_covariance(graph, 1, 4));
    EXPECT_NO_THROW(relative_covariance(graph, 7, 10));
    EXPECT_NO_THROW(marginal_covariances(graph, {5}));
    EXPECT_THAT(error_of([&] { relative_covariance(graph, 1, 7); }), HasSubstr("nothing ties"));
    EXPECT_THAT(error_of([&] { marginal_covariances(graph, {7}); }), HasSubstr("nothing ties"));
    graph.fixed = {0, 6};
    EXPECT_NO_THROW(relative_covariance(graph, 1, 7));
    EXPECT_NO_THROW(marginal_covariances(graph, {1, 7}));
}

TEST(Covariance, RefusesWhatTheEdgesDoNotDetermine) {
    PoseGraph graph = random_graph(8, 6, 0);
    graph.edges[3].information = Eigen::Vector3d(1.0, 0.0, 1.0).asDiagonal();
    EXPECT_THAT(error_of([&] { relative_covariance(graph, 0, 5); }), HasSubstr("do not determine"));
    EXPECT_THAT(error_of([&] { marginal_covariances(graph, {5}); }), HasSubstr("do not determine"));
    graph.edges.push_back(test::edge_between(0, 5, between(graph.nodes[0], graph.nodes[5])));
    EXPECT_NO_THROW(relative_covariance(graph, 0, 5));
}

TEST(Covariance, RefusesNodesThatAreNotThere) {
    const PoseGraph graph = random_graph(9, 5, 1);
    EXPECT_THAT(error_of([&] { relative_covariance(graph, 0, 5); }), HasSubstr("node 5 of 5"));
    EXPECT_THAT(error_of([&] { marginal_covariances(graph, {17}); }), HasSubstr("node 17 of 5"));
    EXPECT_TRUE(marginal_covariances(graph, {}).empty());
}

}  // namespace
}  // namespace hybrid_slam
