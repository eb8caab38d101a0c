// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/pose_graph.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "graph_support.hpp"
#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam {
namespace {

using test::DenseOracle;
using test::edge_between;
using test::error_of;
using test::PoseNear;
using test::Random;
using test::random_graph;
using ::testing::HasSubstr;

void shake(PoseGraph& graph, unsigned seed, double metres, double angle) {
    Random random(seed);
    for (std::size_t node = 1; node < graph.nodes.size(); ++node) {
        graph.nodes[node] = graph.nodes[node] * Pose2d(random.normal(metres), random.normal(metres),
                                                       random.normal(angle));
    }
}

void expect_same_nodes(const PoseGraph& found, const PoseGraph& expected, double tolerance) {
    ASSERT_EQ(found.nodes.size(), expected.nodes.size());
    for (std::size_t node = 0; node < found.nodes.size(); ++node) {
        EXPECT_THAT(found.nodes[node], PoseNear(expected.nodes[node], tolerance, tolerance))
            << node;
    }
}

OptimizeOptions tight(LinearStart start) {
    OptimizeOptions options;
    options.start = start;
    options.function_tolerance = 1e-14;
    return options;
}

TEST(Chi2, IsTheSumOfMahalanobisNorms) {
    PoseGraph graph = random_graph(1, 8, 3);
    shake(graph, 2, 0.5, 0.5);
    double sum = 0.0;
    for (const Edge& edge : graph.edges) {
        sum += chi2(edge, graph.nodes[edge.from], graph.nodes[edge.to]);
    }
    EXPECT_NEAR(chi2(graph), sum, 1e-9 * sum);
    Prior prior;
    prior.node = 2;
    prior.map_from_node = graph.nodes[2] * Pose2d(0.5, 0.0, 0.25);
    prior.information = Eigen::Vector3d(4.0, 1.0, 16.0).asDiagonal();
    graph.priors.push_back(prior);
    const double x = 0.5 * std::cos(0.25);  // of the node seen from the measured pose
    const double y = 0.5 * std::sin(0.25);
    EXPECT_NEAR(chi2(graph) - sum, 4.0 * x * x + y * y + 16.0 * 0.25 * 0.25, 1e-6);
}

TEST(Optimize, MatchesDenseGaussNewton) {
    for (unsigned seed = 0; seed < 5; ++seed) {
        for (const LinearStart start : {LinearStart::kNone, LinearStart::kChordal}) {
            PoseGraph graph = random_graph(seed, 20, 8);
            DenseOracle oracle(graph, {0});
            oracle.optimize(8);
            shake(graph, seed + 50, 0.1, 0.05);
            const OptimizeSummary summary = optimize(graph, tight(start));
            EXPECT_TRUE(summary.usable && summary.converged) << summary.message;
            expect_same_nodes(graph, oracle.graph(), 1e-6);
            EXPECT_NEAR(summary.final_chi2, chi2(oracle.graph()), 1e-8);
            EXPECT_NEAR(summary.final_chi2, chi2(graph), 1e-9);
        }
    }
}

TEST(Optimize, MatchesDenseGaussNewtonWithPriorsAndSemidefiniteInformation) {
    Random random(3);
    PoseGraph graph = random_graph(3, 20, 8);
    for (const std::size_t node : {std::size_t{4}, std::size_t{15}}) {
        Prior prior;
        prior.node = node;
        prior.map_from_node = graph.nodes[node] * Pose2d(0.05, -0.02, 0.03);
        prior.information = random.information();
        graph.priors.push_back(prior);
    }
    const Eigen::Vector3d direction(3.0, -2.0, 1.0);
    graph.edges.back().information = direction * direction.transpose();
    DenseOracle oracle(graph, {});
    oracle.optimize(8);
    shake(graph, 4, 0.1, 0.05);
    optimize(graph, tight(LinearStart::kChordal));
    expect_same_nodes(graph, oracle.graph(), 1e-6);
}

TEST(Optimize, IsBlindToWholeTurnsAndToTheFrameOfTheMap) {
    PoseGraph graph = random_graph(5, 15, 5);
    shake(graph, 6, 0.2, 0.1);
    PoseGraph turned = graph;
    const Pose2d other_from_map(100.0, -50.0, 3.0);
    for (std::size_t node = 0; node < turned.nodes.size(); ++node) {
        turned.nodes[node] = other_from_map * turned.nodes[node];
        turned.nodes[node].heading += 2.0 * kPi * static_cast<double>(node % 3);
    }
    for (Edge& edge : turned.edges) {
        edge.from_from_to.heading -= 2.0 * kPi;
    }
    optimize(graph, tight(LinearStart::kNone));
    optimize(turned, tight(LinearStart::kNone));
    for (std::size_t node = 0; node < graph.nodes.size(); ++node) {
        EXPECT_THAT(turned.nodes[node], PoseNear(other_from_map * graph.nodes[node], 1e-6, 1e-7));
        EXPECT_LE(std::abs(turned.nodes[node].heading), kPi);
    }
}

TEST(Optimize, RepeatsBitForBit) {
    PoseGraph first = test::town_walk(2, 300, 0.03, 0.03);
    PoseGraph second = first;
    optimize(first);
    optimize(second);
    for (std::size_t node = 0; node < first.nodes.size(); ++node) {
        EXPECT_EQ(first.nodes[node].vector(), second.nodes[node].vector());
    }
}

TEST(Optimize, HoldsFixedNodesExactly) {
    PoseGraph graph = random_graph(7, 15, 5);
    graph.fixed = {3, 9};
    shake(graph, 8, 0.1, 0.1);
    const std::vector<Pose2d> before = graph.nodes;
    for (const LinearStart start : {LinearStart::kNone, LinearStart::kChordal}) {
        const OptimizeSummary summary = optimize(graph, tight(start));
        EXPECT_LT(summary.final_chi2, summary.initial_chi2 + 1e-9);
        EXPECT_THAT(graph.nodes[3], PoseNear(before[3], 0.0, 0.0));
        EXPECT_THAT(graph.nodes[9], PoseNear(before[9], 0.0, 0.0));
        EXPECT_GT((graph.nodes[0].translation - before[0].translation).norm(), 1e-3);
    }
}

TEST(Optimize, APriorMovesTheWholeGraphToTheMap) {
    PoseGraph graph = random_graph(9, 10, 3);
    optimize(graph, tight(LinearStart::kNone));
    const Pose2d map_from_old(5.0, -3.0, 0.4);
    Prior prior;
    prior.node = 6;
    prior.map_from_node = map_from_old * graph.nodes[6];
    graph.priors.push_back(prior);
    PoseGraph moved = graph;
    const OptimizeSummary summary = optimize(moved, tight(LinearStart::kNone));
    EXPECT_TRUE(summary.converged) << summary.message;
    for (std::size_t node = 0; node < graph.nodes.size(); ++node) {
        EXPECT_THAT(moved.nodes[node], PoseNear(map_from_old * graph.nodes[node], 1e-5, 1e-5));
    }
}

/// A square round with one closure that is right and one that is far off.
PoseGraph graph_with_a_wrong_closure(std::vector<Pose2d>& truth) {
    PoseGraph graph = test::town_walk(11, 60, 0.01, 0.005);
    optimize(graph);
    truth = graph.nodes;
    Edge wrong = edge_between(5, 50, {0.0, 0.0, 0.0});
    wrong.information = graph.edges.front().information;
    graph.edges.push_back(wrong);
    return graph;
}

double furthest(const std::vector<Pose2d>& a, const std::vector<Pose2d>& b) {
    double distance = 0.0;
    for (std::size_t node = 0; node < a.size(); ++node) {
        distance = std::max(distance, (a[node].translation - b[node].translation).norm());
    }
    return distance;
}

TEST(Optimize, KernelsResistAWrongClosure) {
    std::vector<Pose2d> truth;
    const PoseGraph graph = graph_with_a_wrong_closure(truth);
    OptimizeOptions options;
    const auto error_with = [&](RobustKernel kernel) {
        options.closure_kernel = kernel;
        PoseGraph copy = graph;
        const OptimizeSummary summary = optimize(copy, options);
        EXPECT_TRUE(summary.usable) << summary.message;
        return furthest(copy.nodes, truth);
    };
    const double none = error_with(RobustKernel::kNone);
    EXPECT_GT(none, 0.5);
    EXPECT_LT(error_with(RobustKernel::kHuber), 0.2 * none);
    EXPECT_LT(error_with(RobustKernel::kCauchy), 0.05 * none);
}

TEST(Optimize, KernelsLeaveOdometryAlone) {
    PoseGraph graph;
    graph.nodes.resize(2);
    graph.edges = {edge_between(0, 1, {0.0, 0.0, 0.0}), edge_between(0, 1, {30.0, 0.0, 0.0})};
    OptimizeOptions options = tight(LinearStart::kNone);
    options.closure_kernel = RobustKernel::kHuber;
    PoseGraph odometry = graph;
    optimize(odometry, options);
    EXPECT_NEAR(odometry.nodes[1].x(), 15.0, 1e-6);
    // The pull of a Huber closure ends at its scale: x - 1 = 0 balances with the odometry's x.
    graph.edges[1].kind = EdgeKind::kClosure;
    optimize(graph, options);
    EXPECT_NEAR(graph.nodes[1].x(), 1.0, 1e-6);
}

TEST(Optimize, KernelsHoldForPriors) {
    PoseGraph graph;
    graph.nodes.resize(1);
    graph.priors.resize(3);
    graph.priors[1].map_from_node = {0.1, 0.0, 0.0};
    graph.priors[2].map_from_node = {50.0, 0.0, 0.0};
    OptimizeOptions options = tight(LinearStart::kChordal);
    options.closure_kernel = RobustKernel::kCauchy;
    optimize(graph, options);
    EXPECT_NEAR(graph.nodes[0].x(), 0.05, 0.05);
}

TEST(Optimize, KernelsLeavePriorsAloneThatAreNotRobust) {
    PoseGraph graph;
    graph.nodes.resize(1);
    graph.priors.resize(3);
    graph.priors[1].map_from_node = {0.1, 0.0, 0.0};
    graph.priors[2].map_from_node = {50.0, 0.0, 0.0};
    for (Prior& prior : graph.priors) {
        prior.robust = false;
    }
    OptimizeOptions options = tight(LinearStart::kNone);
    options.closure_kernel = RobustKernel::kCauchy;
    optimize(graph, options);
    EXPECT_NEAR(graph.nodes[0].x(), 50.1 / 3.0, 1e-6);
}

TEST(Optimize, TakesAGraphInSeveralParts) {
    PoseGraph graph = random_graph(12, 8, 3);
    const PoseGraph other = random_graph(13, 7, 3);
    for (Edge edge : other.edges) {
        edge.from += 8;
        edge.to += 8;
        graph.edges.push_back(edge);
    }
    graph.nodes.insert(graph.nodes.end(), other.nodes.begin(), other.nodes.end());
    graph.nodes.emplace_back(1.0, 2.0, 3.0);  // joined to nothing
    DenseOracle oracle(graph, {0, 8, 15});
    oracle.optimize(8);
    shake(graph, 14, 0.1, 0.1);
    graph.nodes[8] = oracle.graph().nodes[8];
    graph.nodes[15] = oracle.graph().nodes[15];
    for (const LinearStart start : {LinearStart::kNone, LinearStart::kChordal}) {
        const OptimizeSummary summary = optimize(graph, tight(start));
        EXPECT_TRUE(summary.usable) << summary.message;
        expect_same_nodes(graph, oracle.graph(), 1e-6);
    }
}

TEST(Optimize, TakesGraphsThatTheirEdgesDoNotDetermine) {
    ::testing::internal::CaptureStderr();
    for (const LinearStart start : {LinearStart::kNone, LinearStart::kChordal}) {
        PoseGraph graph = random_graph(15, 8, 0);
        graph.edges[2].information = Eigen::Vector3d(0.0, 1.0, 0.0).asDiagonal();
        graph.edges[5].information.setZero();
        shake(graph, 16, 0.1, 0.1);
        OptimizeOptions options;
        options.start = start;
        const OptimizeSummary summary = optimize(graph, options);
        EXPECT_TRUE(summary.usable) << summary.message;
        EXPECT_LT(summary.final_chi2, 1e-3 * summary.initial_chi2);
    }
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(Optimize, TakesTheSmallestGraphs) {
    PoseGraph empty;
    EXPECT_TRUE(optimize(empty).usable);
    PoseGraph one;
    one.nodes.emplace_back(1.0, 2.0, 3.0);
    EXPECT_TRUE(optimize(one).usable);
    EXPECT_THAT(one.nodes[0], PoseNear(Pose2d(1.0, 2.0, 3.0), 0.0, 0.0));
    PoseGraph held;
    held.nodes.resize(2);
    held.fixed = {0, 1};
    held.edges = {edge_between(0, 1, {1.0, 0.0, 0.0})};
    const OptimizeSummary summary = optimize(held);
    EXPECT_TRUE(summary.usable) << summary.message;
    EXPECT_DOUBLE_EQ(summary.final_chi2, 1.0);
}

TEST(Optimize, ANodeThatIsNotFiniteLeavesAllAsTheyWere) {
    PoseGraph graph = random_graph(17, 5, 1);
    shake(graph, 18, 0.1, 0.1);
    graph.nodes[3].translation.x() = std::numeric_limits<double>::infinity();
    const std::vector<Pose2d> before = graph.nodes;
    const OptimizeSummary summary = optimize(graph);
    EXPECT_FALSE(summary.usable);
    EXPECT_FALSE(summary.converged);
    EXPECT_THAT(summary.message, HasSubstr("not finite"));
    for (std::size_t node = 0; node < before.size(); ++node) {
        EXPECT_EQ(graph.nodes[node].vector(), before[node].vector());
    }
}

TEST(Optimize, StopsAtTheIterationLimit) {
    PoseGraph graph = test::town_walk(3, 200, 0.05, 0.05);
    OptimizeOptions options;
    options.max_iterations = 1;
    const OptimizeSummary summary = optimize(graph, options);
    EXPECT_TRUE(summary.usable);
    EXPECT_FALSE(summary.converged);
    EXPECT_EQ(summary.iterations, 1);
    EXPECT_LT(summary.final_chi2, summary.start_chi2);
}

TEST(Optimize, NeverLeavesAGoodGraphForAWorseStart) {
    PoseGraph graph = random_graph(19, 30, 10);
    optimize(graph, tight(LinearStart::kNone));
    const OptimizeSummary summary = optimize(graph, tight(LinearStart::kChordal));
    EXPECT_DOUBLE_EQ(summary.start_chi2, summary.initial_chi2);
    EXPECT_LE(summary.final_chi2, summary.initial_chi2);
}

TEST(Optimize, NamesWhatItRefuses) {
    const PoseGraph good = random_graph(20, 5, 1);
    const auto refusal = [&](auto&& spoil) {
        PoseGraph graph = good;
        spoil(graph);
        return error_of([&] { optimize(graph); });
    };
    EXPECT_THAT(refusal([](PoseGraph& g) { g.edges[2].to = 5; }),
                HasSubstr("edge 2 names node 5 of 5"));
    EXPECT_THAT(refusal([](PoseGraph& g) { g.edges[1].from = g.edges[1].to; }),
                HasSubstr("edge 1 joins node 2 to itself"));
    EXPECT_THAT(refusal([](PoseGraph& g) { g.edges[3].from_from_to.heading = std::nan(""); }),
                HasSubstr("edge 3 has a measurement that is not finite"));
    EXPECT_THAT(refusal([](PoseGraph& g) { g.edges[0].information(0, 0) = -1.0; }),
                HasSubstr("edge 0 has an information"));
    EXPECT_THAT(refusal([](PoseGraph& g) { g.edges[0].information(0, 1) += 1.0; }),
                HasSubstr("not symmetric positive semidefinite"));
    EXPECT_THAT(refusal([](PoseGraph& g) { g.priors.resize(1), g.priors[0].node = 8; }),
                HasSubstr("prior 0 names node 8 of 5"));
    EXPECT_THAT(refusal([](PoseGraph& g) {
                    g.fixed = {1, 9};
                }),
                HasSubstr("fixed entry 1 names node 9 of 5"));
}

TEST(Optimize, RefusesOptionsOutOfRange) {
    const auto refusal = [](auto&& spoil) {
        PoseGraph graph = random_graph(21, 5, 1);
        OptimizeOptions options;
        spoil(options);
        return error_of([&] { optimize(graph, options); });
    };
    EXPECT_THAT(refusal([](OptimizeOptions& o) { o.threads = 0; }), HasSubstr("threads"));
    EXPECT_THAT(refusal([](OptimizeOptions& o) { o.kernel_scale = 0.0; }), HasSubstr("kernel"));
    EXPECT_THAT(refusal([](OptimizeOptions& o) { o.max_iterations = -1; }),
                HasSubstr("iterations"));
    EXPECT_THAT(refusal([](OptimizeOptions& o) { o.function_tolerance = std::nan(""); }),
                HasSubstr("function_tolerance"));
}

}  // namespace
}  // namespace hybrid_slam
