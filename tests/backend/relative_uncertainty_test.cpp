// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "hybrid_slam/backend/loop_closing.hpp"
#include "support/room.hpp"

namespace hybrid_slam::test {
namespace {

Edge step(std::size_t from, std::size_t to, const Pose2d& from_from_to,
          const Eigen::Matrix3d& covariance) {
    Edge edge;
    edge.from = from;
    edge.to = to;
    edge.from_from_to = from_from_to;
    edge.information = covariance.inverse();
    return edge;
}

Eigen::Matrix3d diagonal(double x, double y, double heading) {
    return Eigen::Vector3d(x, y, heading).asDiagonal();
}

/// Nodes 0, 1, ... along the edges, each from the one before.
PoseGraph chain(const std::vector<Pose2d>& steps, const std::vector<Eigen::Matrix3d>& covariances) {
    PoseGraph graph;
    graph.nodes.emplace_back(1.0, -2.0, 0.7);
    for (std::size_t i = 0; i < steps.size(); ++i) {
        graph.edges.push_back(step(i, i + 1, steps[i], covariances[i]));
        graph.nodes.push_back(graph.nodes.back() * steps[i]);
    }
    return graph;
}

void expect_close(const Eigen::Matrix3d& found, const Eigen::Matrix3d& expected, double relative) {
    EXPECT_LT((found - expected).norm(), relative * expected.norm()) << "found\n"
                                                                     << found << "\nexpected\n"
                                                                     << expected;
}

// n straight steps of d, each with variances (a, a, h): the heading error of step k swings the n -
// k steps after it.
TEST(RelativeUncertainties, OfAStraightChainAreTheClosedForm) {
    constexpr int kSteps = 12;
    const double d = 0.5;
    const double a = 4e-4;
    const double h = 1e-4;
    const PoseGraph graph = chain(std::vector<Pose2d>(kSteps, Pose2d(d, 0.0, 0.0)),
                                  std::vector<Eigen::Matrix3d>(kSteps, diagonal(a, a, h)));
    const auto seen = relative_uncertainties(graph, kSteps);
    ASSERT_EQ(seen.size(), graph.nodes.size());
    for (std::size_t from = 0; from <= kSteps; ++from) {
        const double n = static_cast<double>(kSteps - from);
        Eigen::Matrix3d expected = diagonal(n * a, n * a, n * h);
        expected(1, 1) += h * d * d * (n - 1) * n * (2 * n - 1) / 6;
        expected(1, 2) = expected(2, 1) = h * d * n * (n - 1) / 2;
        if (from == kSteps) {
            EXPECT_TRUE(seen[from].isZero(0.0)) << "a node knows itself";
        } else {
            expect_close(seen[from], expected, 1e-9);
        }
    }
}

// The pose of the last node seen from the first, over many draws of the edges' own errors. An
// edge's information is of its residual, in the axes of the node where it ends.
TEST(RelativeUncertainties, OfACurvedChainAreThoseOfManyDraws) {
    const std::vector<Pose2d> steps{
        {1.0, 0.2, 0.9}, {0.8, -0.1, 0.7}, {1.2, 0.0, -1.4}, {0.5, 0.5, 2.0}};
    std::vector<Eigen::Matrix3d> covariances;
    Rng rng(61);
    for (std::size_t i = 0; i < steps.size(); ++i) {
        const Eigen::Matrix3d correlated =
            Eigen::Matrix3d::Identity() + 0.5 * Eigen::Matrix3d::Ones();
        const Eigen::Vector3d scale(0.03, 0.003, 0.005);  // much surer sideways
        covariances.emplace_back(scale.asDiagonal() * correlated * scale.asDiagonal());
    }
    const PoseGraph graph = chain(steps, covariances);
    const Pose2d truth = between(graph.nodes.front(), graph.nodes.back());
    Eigen::Matrix3d forward = Eigen::Matrix3d::Zero();
    Eigen::Matrix3d backward = Eigen::Matrix3d::Zero();
    constexpr int kDraws = 40000;
    for (int draw = 0; draw < kDraws; ++draw) {
        Pose2d pose;
        for (std::size_t i = 0; i < steps.size(); ++i) {
            const Eigen::Vector3d unit(gauss(rng, 1.0), gauss(rng, 1.0), gauss(rng, 1.0));
            const Eigen::Vector3d error = covariances[i].llt().matrixL() * unit;
            pose = pose * steps[i] * Pose2d(error.x(), error.y(), error.z());
        }
        const Eigen::Vector3d off = pose.vector() - truth.vector();
        forward += off * off.transpose() / kDraws;
        const Eigen::Vector3d back = pose.inverse().vector() - truth.inverse().vector();
        backward += back * back.transpose() / kDraws;
    }
    expect_close(relative_uncertainties(graph, graph.nodes.size() - 1).front(), forward, 0.05);
    // Seen from the other end: the covariance of the inverse.
    expect_close(relative_uncertainties(graph, 0).back(), backward, 0.05);
}

TEST(RelativeUncertainties, DoNotDependOnWhichWayAnEdgeIsWritten) {
    const std::vector<Pose2d> steps{{1.0, 0.2, 0.9}, {0.8, -0.1, 0.7}};
    const std::vector<Eigen::Matrix3d> covariances(2, diagonal(1e-3, 4e-4, 1e-4));
    const PoseGraph graph = chain(steps, covariances);
    PoseGraph turned = graph;
    for (Edge& edge : turned.edges) {
        // r' = -Ad r, to first order, for the edge written the other way round.
        const Eigen::Matrix3d adjoint = edge.from_from_to.adjoint();
        edge = step(edge.to, edge.from, edge.from_from_to.inverse(),
                    adjoint * edge.information.inverse() * adjoint.transpose());
    }
    const auto plain = relative_uncertainties(graph, 2);
    const auto same = relative_uncertainties(turned, 2);
    for (std::size_t i = 0; i < 2; ++i) {
        expect_close(same[i], plain[i], 1e-9);
    }
}

TEST(RelativeUncertainties, AreThoseOfTheFullSolutionInAChain) {
    const std::vector<Pose2d> steps{{1.0, 0.2, 0.9}, {0.8, -0.1, 0.7}, {1.2, 0.0, -1.4}};
    const std::vector<Eigen::Matrix3d> covariances(3, diagonal(9e-4, 1e-4, 4e-4));
    const PoseGraph graph = chain(steps, covariances);
    const auto seen = relative_uncertainties(graph, 3);
    for (std::size_t from = 0; from < 3; ++from) {
        expect_close(seen[from], relative_covariance(graph, from, 3), 1e-6);
    }
}

/// A square of 40 steps, 10 m a side, without and with the closure at its end.
PoseGraph square(bool closed) {
    std::vector<Pose2d> steps;
    for (int i = 0; i < 39; ++i) {
        steps.emplace_back(1.0, 0.0, i % 10 == 9 ? kPi / 2.0 : 0.0);
    }
    const Eigen::Matrix3d covariance = diagonal(1e-4, 1e-4, 1e-5);
    PoseGraph graph = chain(steps, std::vector<Eigen::Matrix3d>(steps.size(), covariance));
    if (closed) {
        graph.edges.push_back(step(0, 39, between(graph.nodes[0], graph.nodes[39]), covariance));
    }
    return graph;
}

TEST(RelativeUncertainties, AClosureShortensTheWay) {
    const auto open = relative_uncertainties(square(false), 39);
    const auto closed = relative_uncertainties(square(true), 39);
    EXPECT_LT(closed[0].trace(), 0.01 * open[0].trace());
    for (std::size_t i = 0; i < 39; ++i) {
        // Half way round both ways are about as long, and the search is greedy.
        EXPECT_LE(closed[i].trace(), open[i].trace() * 1.05) << i;
    }
    expect_close(closed[38], open[38], 1e-9);
}

TEST(RelativeUncertainties, AreConservativeAgainstTheFullSolution) {
    // The shortest way forgets what other ways add: never surer than the full solution.
    const PoseGraph graph = square(true);
    const auto seen = relative_uncertainties(graph, 39);
    for (const std::size_t from : {0U, 5U, 12U, 20U, 30U}) {
        const Eigen::Matrix3d surplus = seen[from] - relative_covariance(graph, from, 39);
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(surplus);
        EXPECT_GT(eigen.eigenvalues()(0), -1e-3 * seen[from].trace()) << from;
    }
}

TEST(RelativeUncertainties, OfANodeThatCannotBeReachedAreWithoutBound) {
    PoseGraph graph = square(false);
    graph.nodes.emplace_back(5.0, 5.0, 0.0);
    const auto seen = relative_uncertainties(graph, 39);
    EXPECT_TRUE(std::isinf(seen.back()(0, 0)));
    EXPECT_TRUE(std::isinf(seen.back()(2, 2)));
    EXPECT_TRUE(seen.front().allFinite());
}

TEST(WithFloor, AddsTheFloorsToTheCovariance) {
    Eigen::Matrix3d covariance = diagonal(4e-4, 9e-4, 1e-4);
    covariance(0, 1) = covariance(1, 0) = 3e-4;
    covariance(1, 2) = covariance(2, 1) = -1e-4;
    const Eigen::Matrix3d floored = with_floor(covariance.inverse(), 0.02, 0.03);
    expect_close(floored.inverse(), covariance + diagonal(4e-4, 4e-4, 9e-4), 1e-9);
    EXPECT_EQ(floored, floored.transpose());
    expect_close(with_floor(covariance.inverse(), 0.0, 0.0).inverse(), covariance, 1e-9);
}

}  // namespace
}  // namespace hybrid_slam::test
