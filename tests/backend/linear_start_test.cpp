// SPDX-License-Identifier: Apache-2.0
#include "linear_start.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "graph_support.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam {
namespace {

using test::PoseNear;
using test::Random;
using test::random_graph;
using ::testing::IsEmpty;

/// Measurements without noise; nodes, but for the first, anywhere at all.
PoseGraph exact_graph_with_lost_nodes(unsigned seed, std::vector<Pose2d>& truth) {
    PoseGraph graph = random_graph(seed, 30, 10);
    for (Edge& edge : graph.edges) {
        edge.from_from_to = between(graph.nodes[edge.from], graph.nodes[edge.to]);
    }
    truth = graph.nodes;
    Random random(seed + 1);
    for (std::size_t node = 1; node < graph.nodes.size(); ++node) {
        graph.nodes[node] = random.pose(50.0);
    }
    return graph;
}

TEST(LinearStart, FindsTheTruthOfExactMeasurementsWithoutAGuess) {
    for (unsigned seed = 0; seed < 5; ++seed) {
        std::vector<Pose2d> truth;
        const PoseGraph graph = exact_graph_with_lost_nodes(seed, truth);
        const std::vector<Pose2d> found = linear_start(graph, find_gauge(graph));
        ASSERT_EQ(found.size(), truth.size());
        for (std::size_t node = 0; node < truth.size(); ++node) {
            EXPECT_THAT(found[node], PoseNear(truth[node], 1e-8, 1e-9)) << node;
        }
    }
}

TEST(LinearStart, KeepsEveryHeldNode) {
    std::vector<Pose2d> truth;
    PoseGraph graph = exact_graph_with_lost_nodes(9, truth);
    for (const std::size_t node : {std::size_t{5}, std::size_t{6}, std::size_t{20}}) {
        graph.fixed.push_back(node);
        graph.nodes[node] = truth[node];
    }
    const std::vector<Pose2d> found = linear_start(graph, find_gauge(graph));
    ASSERT_EQ(found.size(), truth.size());
    for (std::size_t node = 0; node < truth.size(); ++node) {
        EXPECT_THAT(found[node], PoseNear(truth[node], 1e-8, 1e-9)) << node;
    }
}

TEST(LinearStart, WeighsWithTheInformation) {
    // Two chains of equal length disagree; the surer one has nearly all the say.
    PoseGraph graph;
    graph.nodes.resize(2);
    graph.edges = {test::edge_between(0, 1, {1.0, 0.0, 0.0}),
                   test::edge_between(0, 1, {2.0, 0.0, 0.4})};
    graph.edges[1].information *= 1e6;
    const std::vector<Pose2d> found = linear_start(graph, find_gauge(graph));
    ASSERT_EQ(found.size(), 2U);
    EXPECT_THAT(found[1], PoseNear(Pose2d(2.0, 0.0, 0.4), 1e-4, 1e-4));
}

TEST(LinearStart, IsEmptyWhereHeadingsAreNotMeasured) {
    PoseGraph graph = random_graph(3, 5, 0);
    graph.edges[2].information = Eigen::Vector3d(1.0, 1.0, 0.0).asDiagonal();
    EXPECT_THAT(linear_start(graph, find_gauge(graph)), IsEmpty());
}

// The graph that the linear start is for: its odometry is so far off that each step from there goes
// astray.
TEST(LinearStart, RescuesAGraphOnWhichPlainStepsStick) {
    const PoseGraph graph = test::town_walk(2, 800, 0.05, 0.2);
    PoseGraph plain = graph;
    OptimizeOptions options;
    options.start = LinearStart::kNone;
    optimize(plain, options);
    options.initial_trust_region = 1e4;
    PoseGraph damped = graph;
    optimize(damped, options);
    PoseGraph rescued = graph;
    const OptimizeSummary summary = optimize(rescued);
    EXPECT_TRUE(summary.converged) << summary.message;
    EXPECT_LT(summary.start_chi2, summary.initial_chi2);
    const double freedom = 3.0 * static_cast<double>(graph.edges.size() - graph.nodes.size() + 1);
    EXPECT_LT(summary.final_chi2, 1.1 * freedom);
    EXPECT_GT(chi2(plain), 2.0 * summary.final_chi2);
    EXPECT_GT(chi2(damped), 2.0 * summary.final_chi2);
}

}  // namespace
}  // namespace hybrid_slam
