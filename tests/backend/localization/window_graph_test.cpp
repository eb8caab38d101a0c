// SPDX-License-Identifier: Apache-2.0
#include "window_graph.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <vector>

#include "backend/graph_support.hpp"
#include "hybrid_slam/core/uncertainty.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

constexpr double kNoKernel = 1e6;  // sigmas, wider than any residual

Eigen::Matrix3d diagonal(double translation, double rotation) {
    return Eigen::Vector3d(translation * translation, translation * translation,
                           rotation * rotation)
        .asDiagonal();
}

/// A chain with small correlated noise, every third node without an anchor.
struct Chain {
    PoseBelief start;
    std::vector<MotionBelief> motions;
    std::vector<std::optional<PoseAnchor>> anchors;
};

Chain random_chain(unsigned seed, std::size_t size) {
    Random random(seed);
    const auto noise = [&](double scale) {
        return Pose2d(random.normal(scale), random.normal(scale), random.normal(scale));
    };
    Chain chain;
    Pose2d truth = random.pose(3.0);
    chain.start = {truth * noise(0.01), diagonal(0.02, 0.01)};
    for (std::size_t i = 0; i < size; ++i) {
        const Pose2d step(0.3, random.uniform(-0.05, 0.05), random.uniform(-0.3, 0.3));
        truth = truth * step;
        chain.motions.push_back({step * noise(0.003), random.information().inverse() * 0.01});
        chain.anchors.emplace_back();
        if (i % 3 != 1) {
            chain.anchors.back() = {truth * noise(0.005), 100.0 * random.information()};
        }
    }
    return chain;
}

PoseBelief follow(WindowGraph& window, const Chain& chain) {
    window.start(chain.start);
    PoseBelief newest;
    for (std::size_t i = 0; i < chain.motions.size(); ++i) {
        newest = window.add(chain.motions[i], chain.anchors[i], true);
    }
    return newest;
}

/// All of the chain in one graph, with the start as a prior.
PoseGraph whole_graph(const Chain& chain) {
    PoseGraph graph;
    const auto own_axes = [](const Eigen::Matrix3d& matrix, const Pose2d& pose) {
        return turned(matrix, pose.rotation().transpose());
    };
    graph.nodes = {chain.start.map_from_robot};
    graph.priors = {{0, chain.start.map_from_robot,
                     own_axes(chain.start.covariance, chain.start.map_from_robot).inverse(), true}};
    for (std::size_t i = 0; i < chain.motions.size(); ++i) {
        graph.nodes.push_back(graph.nodes.back() * chain.motions[i].before_from_now);
        Edge edge = edge_between(i, i + 1, chain.motions[i].before_from_now);
        edge.information = chain.motions[i].covariance.inverse();
        graph.edges.push_back(edge);
        if (chain.anchors[i]) {
            const Pose2d& pose = chain.anchors[i]->map_from_robot;
            graph.priors.push_back(
                {i + 1, pose, own_axes(chain.anchors[i]->information, pose), true});
        }
    }
    return graph;
}

TEST(WindowGraph, TheNewestPoseIsThatOfTheWholeDrive) {
    for (const unsigned seed : {1U, 2U, 3U}) {
        const Chain chain = random_chain(seed, 25);
        DenseOracle oracle(whole_graph(chain), {});
        oracle.optimize(6);
        const Pose2d& expected = oracle.graph().nodes.back();
        const Eigen::Index last = 3 * (static_cast<Eigen::Index>(oracle.graph().nodes.size()) - 1);
        const Eigen::Matrix3d covariance =
            turned(oracle.information().inverse().block<3, 3>(last, last), expected.rotation());
        for (const std::size_t nodes : {1U, 4U, 12U, 100U}) {
            WindowGraph window(nodes, kNoKernel);
            const PoseBelief newest = follow(window, chain);
            // The past is linearised where it stood when it was left: a second order effect.
            EXPECT_THAT(newest.map_from_robot, PoseNear(expected, 2e-5, 2e-5)) << nodes;
            EXPECT_LT((newest.covariance - covariance).norm(), 0.01 * covariance.norm()) << nodes;
            EXPECT_EQ(window.graph().nodes.size(), std::min<std::size_t>(nodes, 26));
        }
    }
}

TEST(WindowGraph, AScanThatIsNotKeptLeavesNoTrace) {
    const Chain chain = random_chain(4, 8);
    WindowGraph window(5, 2.0);
    follow(window, chain);
    WindowGraph other = window;
    const MotionBelief motion{{0.1, 0.0, 0.05}, diagonal(0.003, 0.002)};
    const PoseAnchor off{window.newest().map_from_robot * Pose2d(0.15, 0.05, 0.0),
                         diagonal(0.005, 0.002).inverse()};
    const Pose2d pulled = window.add(motion, off, false).map_from_robot;
    const Pose2d free = other.add(motion, std::nullopt, false).map_from_robot;
    EXPECT_GT((pulled.translation - free.translation).norm(), 1e-3);
    const MotionBelief next{{0.2, 0.0, 0.1}, diagonal(0.003, 0.002)};
    EXPECT_EQ(window.add(next, std::nullopt, true).map_from_robot.vector(),
              other.add(next, std::nullopt, true).map_from_robot.vector());
}

TEST(WindowGraph, AnAnchorFarOffIsHardlyBelievedAndOneNearIs) {
    const auto pull = [](double off) {
        WindowGraph window(5, 2.0);
        window.start({{}, diagonal(0.002, 0.001)});
        const PoseAnchor anchor{{0.3, off, 0.0}, diagonal(0.002, 0.001).inverse()};
        return window.add({{0.3, 0.0, 0.0}, diagonal(0.002, 0.001)}, anchor, true)
            .map_from_robot.y();
    };
    EXPECT_NEAR(pull(0.002), 0.00133, 2e-4);
    EXPECT_LT(pull(0.2), 0.001);
}

TEST(WindowGraph, WithoutAnchorsTheDoubtAddsUpAlsoBeyondTheWindow) {
    WindowGraph window(4, 2.0);
    window.start({{}, diagonal(0.01, 1e-4)});
    const MotionBelief motion{{0.5, 0.0, 0.0}, diagonal(0.003, 1e-4)};
    PoseBelief newest;
    for (int i = 0; i < 100; ++i) {
        newest = window.add(motion, std::nullopt, true);
    }
    EXPECT_THAT(newest.map_from_robot, PoseNear(Pose2d(50.0, 0.0, 0.0), 1e-6, 1e-8));
    EXPECT_NEAR(newest.covariance(0, 0), 1e-4 + 100.0 * 9e-6, 1e-6);
    EXPECT_NEAR(newest.covariance(2, 2), 101.0 * 1e-8, 1e-10);
}

TEST(WindowGraph, WhatAnAnchorDoesNotSayStaysInDoubt) {
    WindowGraph window(4, 2.0);
    const Pose2d start(1.0, 2.0, 1.0);
    window.start({start, diagonal(0.01, 0.01)});
    const MotionBelief motion{{0.5, 0.0, 0.1}, diagonal(0.01, 0.001)};
    PoseBelief newest{start, {}};
    for (int i = 0; i < 20; ++i) {
        PoseAnchor anchor;
        anchor.map_from_robot = newest.map_from_robot * motion.before_from_now;
        anchor.map_from_robot.translation.x() += 3.0;  // of x it knows nothing
        anchor.information.diagonal() << 0.0, 1e4, 1e6;
        newest = window.add(motion, anchor, true);
    }
    EXPECT_GT(newest.covariance(0, 0), 1e-4 + 19.0 * 1e-4);
    EXPECT_LT(newest.covariance(1, 1), 1e-4);
}

TEST(WindowGraph, AStartForgetsAll) {
    const Chain chain = random_chain(5, 10);
    WindowGraph used(4, 2.0);
    follow(used, random_chain(6, 10));
    WindowGraph fresh(4, 2.0);
    EXPECT_EQ(follow(used, chain).map_from_robot.vector(),
              follow(fresh, chain).map_from_robot.vector());
}

TEST(AnchorChi2, CountsBothDoubtsAndNothingThatIsNotSaid) {
    const PoseBelief belief{{1.0, 2.0, 3.1}, diagonal(0.03, 0.01)};
    PoseAnchor anchor{{1.1, 2.0, 3.1}, diagonal(0.04, 0.01).inverse()};
    EXPECT_NEAR(chi2(anchor, belief), 0.01 / 0.0025, 1e-9);
    anchor.map_from_robot.heading = -3.1;  // 0.083 rad on
    EXPECT_GT(chi2(anchor, belief), 10.0);
    EXPECT_LT(chi2(anchor, belief), 100.0);
    anchor.information(0, 0) = 0.0;
    anchor.map_from_robot = {500.0, 2.0, 3.1};
    EXPECT_NEAR(chi2(anchor, belief), 0.0, 1e-9);
}

}  // namespace
}  // namespace hybrid_slam::test
