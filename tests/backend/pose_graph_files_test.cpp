// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ostream>
#include <sstream>
#include <string>

#include "benchmark/benchmarks.hpp"
#include "graph_support.hpp"
#include "hybrid_slam/backend/g2o.hpp"
#include "support/shared_data.hpp"

namespace hybrid_slam {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

struct KnownGraph {
    const char* file;
    std::size_t nodes;
    std::size_t edges;
    double optimum;
};

void PrintTo(const KnownGraph& graph, std::ostream* out) {
    *out << graph.file;
}

class RealGraph : public ::testing::TestWithParam<KnownGraph> {};

TEST_P(RealGraph, ReachesItsOptimumFromOdometry) {
    HYBRID_SLAM_SHARED_OR_SKIP(file, std::string("data/posegraph/") + GetParam().file);
    G2oFile content = read_g2o(file);
    EXPECT_EQ(content.graph.nodes.size(), GetParam().nodes);
    EXPECT_EQ(content.graph.edges.size(), GetParam().edges);
    EXPECT_EQ(content.skipped_lines, 0U);
    const OptimizeSummary summary = optimize(content.graph);
    EXPECT_TRUE(summary.converged) << summary.message;
    EXPECT_NEAR(summary.final_chi2, GetParam().optimum, 1e-4 * GetParam().optimum);
    EXPECT_LE(summary.iterations, 10);
}

TEST_P(RealGraph, ComesBackFromASmallShakeInAFewIterations) {
    HYBRID_SLAM_SHARED_OR_SKIP(file, std::string("data/posegraph/") + GetParam().file);
    PoseGraph graph = read_g2o(file).graph;
    optimize(graph);
    test::Random random(1);
    for (std::size_t node = 1; node < graph.nodes.size(); ++node) {
        graph.nodes[node] = graph.nodes[node] *
                            Pose2d(random.normal(0.01), random.normal(0.01), random.normal(0.001));
    }
    OptimizeOptions warm;
    warm.start = LinearStart::kNone;
    const OptimizeSummary summary = optimize(graph, warm);
    EXPECT_NEAR(summary.final_chi2, GetParam().optimum, 1e-4 * GetParam().optimum);
    EXPECT_LE(summary.iterations, 4);
}

INSTANTIATE_TEST_SUITE_P(Files, RealGraph,
                         ::testing::Values(KnownGraph{"M3500.g2o", 3500, 5453, 3549.04},
                                           KnownGraph{"intel.g2o", 1728, 2512, 45.005},
                                           KnownGraph{"MIT.g2o", 808, 827, 41.163},
                                           KnownGraph{"CSAIL.g2o", 1045, 1172, 40.555},
                                           KnownGraph{"city10000.g2o.gz", 10000, 20687, 511.985}));

TEST(RealGraphs, MitSticksWithoutTheLinearStart) {
    HYBRID_SLAM_SHARED_OR_SKIP(file, "data/posegraph/MIT.g2o");
    PoseGraph graph = read_g2o(file).graph;
    OptimizeOptions plain;
    plain.start = LinearStart::kNone;
    EXPECT_GT(optimize(graph, plain).final_chi2, 10.0 * 41.163);
}

TEST(RealGraphs, CovariancesOfALargeGraphArePositiveAndGrow) {
    HYBRID_SLAM_SHARED_OR_SKIP(file, "data/posegraph/intel.g2o");
    PoseGraph graph = read_g2o(file).graph;
    optimize(graph);
    const Eigen::Matrix3d far = relative_covariance(graph, 0, 1727);
    const Eigen::Matrix3d near = relative_covariance(graph, 1726, 1727);
    EXPECT_TRUE(far.isApprox(far.transpose(), 1e-9));
    EXPECT_EQ(Eigen::LLT<Eigen::Matrix3d>(near).info(), Eigen::Success);
    EXPECT_GT(far.trace(), near.trace());
}

TEST(GraphsBenchmark, PrintsARowForEachFile) {
    HYBRID_SLAM_SHARED_OR_SKIP(shared, "data/posegraph");
    std::ostringstream table;
    run_graphs_benchmark(shared.parent_path().parent_path(), table);
    for (const char* name : {"M3500", "intel", "MIT", "CSAIL", "city10000", "warm"}) {
        EXPECT_THAT(table.str(), HasSubstr(name));
    }
    EXPECT_THAT(table.str(), Not(HasSubstr("stuck")));
}

}  // namespace
}  // namespace hybrid_slam
