// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "hybrid_slam/backend/g2o.hpp"
#include "running.hpp"
#include "support/pose_matchers.hpp"
#include "support/shared_data.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

/// A square of 4 x 4 m, its nodes as a drifting odometry has them, ids from 100 on.
PoseGraph drifting_square() {
    PoseGraph graph;
    const Pose2d step(1.0, 0.0, 0.0);
    const Pose2d turn(1.0, 0.0, kPi / 2.0);
    graph.nodes.emplace_back();
    for (std::size_t i = 0; i < 16; ++i) {
        const Pose2d& motion = i % 4 == 3 ? turn : step;
        graph.nodes.push_back(graph.nodes.back() * motion * Pose2d(0.02, 0.01, 0.03));
        graph.edges.push_back({i, i + 1, motion, Eigen::Vector3d(100.0, 100.0, 400.0).asDiagonal(),
                               EdgeKind::kOdometry});
    }
    graph.edges.push_back(
        {0, 16, Pose2d(), Eigen::Vector3d(500.0, 500.0, 500.0).asDiagonal(), EdgeKind::kClosure});
    return graph;
}

std::vector<long> ids_from(long first, std::size_t count) {
    std::vector<long> ids;
    for (std::size_t i = 0; i < count; ++i) {
        ids.push_back(first + static_cast<long>(i));
    }
    return ids;
}

TEST(Optimize, SolvesTheGraphAndKeepsIdsAndEdges) {
    const TempFolder folder;
    const PoseGraph square = drifting_square();
    write_g2o(folder / "in.g2o", square, ids_from(100, square.nodes.size()));
    const Json json = run_well(folder, "optimize in.g2o --out out.g2o --json").json();
    EXPECT_NEAR(json["chi2_before"].get<double>(), chi2(square), 1e-6 * chi2(square));
    EXPECT_LT(json["chi2_after"], 1e-6);
    EXPECT_EQ(json["converged"], true);
    const G2oFile solved = read_g2o(folder / "out.g2o");
    EXPECT_EQ(solved.ids, ids_from(100, square.nodes.size()));
    ASSERT_EQ(solved.graph.edges.size(), square.edges.size());
    EXPECT_THAT(solved.graph.nodes[4], PoseNear(Pose2d(4.0, 0.0, kPi / 2.0), 1e-4, 1e-4));
    EXPECT_THAT(solved.graph.nodes[16], PoseNear(Pose2d(), 1e-4, 1e-4));
}

TEST(Optimize, SolvedGraphStaysAsItIs) {
    const TempFolder folder;
    write_g2o(folder / "in.g2o", drifting_square());
    run_well(folder, "optimize in.g2o --out once.g2o.gz");
    run_well(folder, "optimize once.g2o.gz --out twice.g2o --start none");
    const PoseGraph once = read_g2o(folder / "once.g2o.gz").graph;
    const PoseGraph twice = read_g2o(folder / "twice.g2o").graph;
    for (std::size_t i = 0; i < once.nodes.size(); ++i) {
        EXPECT_THAT(twice.nodes[i], PoseNear(once.nodes[i], 1e-6, 1e-6));
    }
}

TEST(Optimize, KernelHoldsAgainstAWrongClosure) {
    const TempFolder folder;
    PoseGraph square = drifting_square();
    square.edges.push_back(
        {2, 10, Pose2d(), Eigen::Vector3d(500.0, 500.0, 500.0).asDiagonal(), EdgeKind::kClosure});
    write_g2o(folder / "in.g2o", square);
    run_well(folder, "optimize in.g2o --out plain.g2o");
    run_well(folder, "optimize in.g2o --out robust.g2o --kernel cauchy");
    const Pose2d corner(4.0, 4.0, kPi);
    const auto off = [&](const char* file) {
        return (read_g2o(folder / file).graph.nodes[8].translation - corner.translation).norm();
    };
    EXPECT_GT(off("plain.g2o"), 0.5);
    EXPECT_LT(off("robust.g2o"), 0.1);
}

TEST(Optimize, OptionsReachTheSolver) {
    const TempFolder folder;
    write_g2o(folder / "in.g2o", drifting_square());
    const Outcome result =
        run_well(folder, "optimize in.g2o --out o.g2o --start none --max-iterations 1 --json");
    EXPECT_EQ(result.json()["iterations"], 1);
    EXPECT_EQ(run(folder, "optimize in.g2o --out o.g2o --max-iterations=-5").code, 2);
}

TEST(Optimize, DrawsBeforeAndAfter) {
    const TempFolder folder;
    write_g2o(folder / "in.g2o", drifting_square());
    run_well(folder, "optimize in.g2o --out out.g2o --png graph.png");
    EXPECT_THAT(bytes_of(folder / "graph.png"), StartsWith("\x89PNG"));
}

TEST(Optimize, BrokenFileNamesTheLine) {
    const TempFolder folder;
    folder.write("broken.g2o", "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 0 zero 0\n");
    const Outcome result = run(folder, "optimize broken.g2o --out out.g2o");
    EXPECT_EQ(result.code, 1);
    EXPECT_THAT(result.err, StartsWith("hybrid-slam: broken.g2o:2: "));
    EXPECT_FALSE(std::filesystem::exists(folder / "out.g2o"));
}

TEST(Optimize, ReachesTheOptimumOfMit) {
    HYBRID_SLAM_SHARED_OR_SKIP(file, "data/posegraph/MIT.g2o");
    const TempFolder folder;
    const Json json =
        run_well(folder, "optimize '" + file.string() + "' --out o.g2o --json").json();
    EXPECT_NEAR(json["chi2_after"].get<double>(), 41.163, 0.0042);
}

}  // namespace
}  // namespace hybrid_slam::test
