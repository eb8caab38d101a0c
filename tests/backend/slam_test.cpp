// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/slam.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include "hybrid_slam/core/metrics.hpp"
#include "hybrid_slam/logs/carmen_log.hpp"
#include "hybrid_slam/simulator/simulator.hpp"
#include "support/pose_matchers.hpp"
#include "support/room.hpp"
#include "support/shared_data.hpp"

namespace hybrid_slam::test {
namespace {

std::vector<Frame> frames_of(Source& source) {
    FrameAssembler assembler;
    std::vector<Frame> frames;
    while (auto measurement = source.next()) {
        if (auto frame = assembler.push(std::move(*measurement))) {
            frames.push_back(std::move(*frame));
        }
    }
    return frames;
}

struct HallDrive {
    std::vector<Frame> frames;
    Trajectory truth;
};

/// Two laps of the ring hall, four scans a second at 1 m/s.
const HallDrive& hall_drive() {
    static const HallDrive drive = [] {
        SimulatorConfig config;
        config.speed = 1.0;
        config.scan_rate = 4.0;
        config.field_of_view = radians(270.0);
        config.angle_increment = radians(0.75);
        config.range_sigma = 0.01;
        config.seed = 3;
        Simulator simulator(ring_hall(), config);
        HallDrive made;
        made.frames = frames_of(simulator);
        made.truth = simulator.truth();
        return made;
    }();
    return drive;
}

/// Scan to scan, so that odometry drifts and the graph has something to do.
SlamConfig drifting_config() {
    SlamConfig config;
    config.odometry.prior.kind = PriorKind::kWheel;
    config.odometry.reference = ReferenceKind::kPreviousScan;
    config.loop_closing.enabled = true;
    config.graph.enabled = true;
    return config;
}

struct SlamRun {
    std::vector<SlamResult> results;
    SlamMap map;
};

SlamRun drive_through(const SlamConfig& config, const std::vector<Frame>& frames) {
    Slam slam(config);
    SlamRun run;
    for (const Frame& frame : frames) {
        run.results.push_back(slam.process(frame));
    }
    slam.refine();
    run.map = slam.map();
    return run;
}

std::vector<Frame> first_of(const std::vector<Frame>& frames, std::size_t count) {
    return {frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(count)};
}

std::size_t closure_edges(const PoseGraph& graph) {
    return static_cast<std::size_t>(
        std::count_if(graph.edges.begin(), graph.edges.end(),
                      [](const Edge& edge) { return edge.kind == EdgeKind::kClosure; }));
}

std::size_t accepted(const std::vector<Closure>& closures) {
    return static_cast<std::size_t>(std::count_if(
        closures.begin(), closures.end(),
        [](const Closure& closure) { return closure.verdict == ClosureVerdict::kAccepted; }));
}

double worst_apart(const Trajectory& a, const Trajectory& b) {
    double worst = a.size() == b.size() ? 0.0 : 1e9;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
        worst = std::max(worst, apart(a[i].pose, b[i].pose));
    }
    return worst;
}

TEST(Slam, TwoLapsOfAHallEndUpMoreAccurateThanOdometry) {
    const HallDrive& drive = hall_drive();
    const SlamRun run = drive_through(drifting_config(), drive.frames);
    const double odometry = truth_error(run.map.odometry_trajectory, drive.truth).ate_rmse;
    const double refined = truth_error(run.map.trajectory, drive.truth).ate_rmse;
    EXPECT_GT(accepted(run.map.closures), 2U);
    EXPECT_LT(refined, 0.5 * odometry);
    EXPECT_LT(refined, 0.1);
}

TEST(Slam, WithTheLocalMapTwoLapsEndUpWithinCentimetres) {
    const HallDrive& drive = hall_drive();
    SlamConfig config;
    config.odometry.prior.kind = PriorKind::kWheel;
    const SlamRun run = drive_through(config, drive.frames);
    EXPECT_LT(truth_error(run.map.trajectory, drive.truth).ate_rmse, 0.05);
    // While driving, too: what each frame said when it was processed.
    Trajectory live;
    for (const SlamResult& result : run.results) {
        live.push_back({result.stamp, result.map_from_robot});
    }
    EXPECT_LT(truth_error(live, drive.truth).ate_rmse, 0.1);
}

TEST(Slam, TellsOfEachFrameWhatItUsedAndFound) {
    const auto frames = first_of(hall_drive().frames, 100);
    const SlamRun run = drive_through(drifting_config(), frames);
    std::map<PriorKind, int> priors;
    std::size_t keyframes = 0;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const SlamResult& result = run.results[i];
        EXPECT_EQ(result.stamp, frames[i].scan.stamp);
        EXPECT_EQ(result.status, i == 0 ? OdometryStatus::kFirst : OdometryStatus::kAligned);
        EXPECT_TRUE(i == 0 || result.icp.usable());
        EXPECT_GE(result.covariance.eigenvalues().real().minCoeff(), -1e-12);
        EXPECT_GE(result.timings.odometry, 0.0);
        EXPECT_DOUBLE_EQ(
            result.timings.total(),
            result.timings.odometry + result.timings.loop_closing + result.timings.optimization);
        ++priors[result.prior_used];
        keyframes += result.keyframe ? 1 : 0;
    }
    EXPECT_EQ(
        priors[PriorKind::kWheel] + priors[PriorKind::kNone] + priors[PriorKind::kConstantVelocity],
        100);
    EXPECT_GE(priors[PriorKind::kWheel], 95);
    EXPECT_GE(priors[PriorKind::kNone], 1) << "the first frame has nothing before it";
    EXPECT_EQ(keyframes, run.map.keyframes.size());
    EXPECT_EQ(keyframes, run.map.graph.nodes.size());
    EXPECT_EQ(keyframes - 1, run.map.graph.edges.size() - closure_edges(run.map.graph));
    EXPECT_THAT(run.results[0].map_from_robot, PoseNear(Pose2d(), 0.0, 0.0));
}

TEST(Slam, CountsFramesWithoutWheels) {
    auto frames = first_of(hall_drive().frames, 60);
    for (std::size_t i = 20; i < 30; ++i) {
        frames[i].odom_from_robot.reset();
    }
    int velocity = 0;
    for (const SlamResult& result : drive_through(drifting_config(), frames).results) {
        velocity += result.prior_used == PriorKind::kConstantVelocity ? 1 : 0;
    }
    EXPECT_GE(velocity, 10);
    EXPECT_LE(velocity, 13);
}

TEST(Slam, WithoutTheGraphItIsItsOdometry) {
    const auto frames = first_of(hall_drive().frames, 150);
    SlamConfig config = drifting_config();
    config.graph.enabled = false;
    const SlamRun run = drive_through(config, frames);
    Odometry odometry(config.odometry);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const Pose2d expected = odometry.register_frame(frames[i]).local_from_robot;
        ASSERT_THAT(run.map.odometry_trajectory[i].pose, PoseNear(expected, 1e-9, 1e-9));
        ASSERT_THAT(run.map.trajectory[i].pose, PoseNear(expected, 1e-9, 1e-9));
        ASSERT_THAT(run.results[i].map_from_robot, PoseNear(expected, 1e-9, 1e-9));
    }
    EXPECT_TRUE(run.map.closures.empty());
}

TEST(Slam, TheTrajectoryHasOnePosePerScanUnderItsOwnStamp) {
    auto frames = first_of(hall_drive().frames, 80);
    for (std::size_t i = 40; i < frames.size(); ++i) {
        frames[i].scan.stamp -= 5.0;  // a clock set back on the way
    }
    frames[60].scan.stamp = frames[59].scan.stamp;
    const SlamMap map = drive_through(drifting_config(), frames).map;
    ASSERT_EQ(map.trajectory.size(), frames.size());
    ASSERT_EQ(map.odometry_trajectory.size(), frames.size());
    for (std::size_t i = 0; i < frames.size(); ++i) {
        EXPECT_EQ(map.trajectory[i].stamp, frames[i].scan.stamp);
        EXPECT_EQ(map.odometry_trajectory[i].stamp, frames[i].scan.stamp);
    }
}

TEST(Slam, TheTrajectoryPassesThroughTheNodesWithoutJumps) {
    const HallDrive& drive = hall_drive();
    const SlamMap map = drive_through(drifting_config(), drive.frames).map;
    std::size_t k = 0;
    for (std::size_t i = 0; i < map.trajectory.size(); ++i) {
        if (k < map.keyframes.size() && map.keyframes[k].stamp == map.trajectory[i].stamp) {
            EXPECT_THAT(map.graph.nodes[k], PoseNear(map.trajectory[i].pose, 1e-9, 1e-9));
            ++k;
        }
        if (i > 0) {
            const Pose2d step = between(map.trajectory[i - 1].pose, map.trajectory[i].pose);
            const Pose2d by_odometry =
                between(map.odometry_trajectory[i - 1].pose, map.odometry_trajectory[i].pose);
            EXPECT_LT(apart(step, by_odometry), 0.05) << "scan " << i;
        }
    }
    EXPECT_EQ(k, map.keyframes.size());
}

TEST(Slam, RefiningAgainChangesNothing) {
    Slam slam(drifting_config());
    for (const Frame& frame : hall_drive().frames) {
        slam.process(frame);
    }
    const OptimizeSummary first = slam.refine();
    EXPECT_TRUE(first.usable);
    const SlamMap once = slam.map();
    const OptimizeSummary second = slam.refine();
    EXPECT_NEAR(second.final_chi2, first.final_chi2, 1e-3 * first.final_chi2 + 1e-6);
    EXPECT_LT(worst_apart(once.trajectory, slam.map().trajectory), 2e-3);
    EXPECT_EQ(accepted(once.closures), accepted(slam.map().closures));
}

TEST(Slam, GoesOnAfterARefinementOnTheWay) {
    const HallDrive& drive = hall_drive();
    Slam slam(drifting_config());
    for (std::size_t i = 0; i < drive.frames.size(); ++i) {
        slam.process(drive.frames[i]);
        if (i % 100 == 50) {
            slam.refine();
        }
    }
    slam.refine();
    EXPECT_LT(truth_error(slam.map().trajectory, drive.truth).ate_rmse, 0.1);
}

TEST(Slam, TwoRunsAreTheSameToTheBit) {
    const HallDrive& drive = hall_drive();
    const SlamMap first = drive_through(drifting_config(), drive.frames).map;
    const SlamMap second = drive_through(drifting_config(), drive.frames).map;
    ASSERT_EQ(first.trajectory.size(), second.trajectory.size());
    for (std::size_t i = 0; i < first.trajectory.size(); ++i) {
        ASSERT_EQ(first.trajectory[i].pose.vector(), second.trajectory[i].pose.vector()) << i;
    }
    ASSERT_EQ(first.graph.edges.size(), second.graph.edges.size());
    for (std::size_t i = 0; i < first.graph.edges.size(); ++i) {
        ASSERT_EQ(first.graph.edges[i].information, second.graph.edges[i].information);
    }
    ASSERT_EQ(first.closures.size(), second.closures.size());
}

TEST(Slam, EveryAcceptedClosureIsAnEdge) {
    const SlamMap map = drive_through(drifting_config(), hall_drive().frames).map;
    EXPECT_EQ(closure_edges(map.graph), accepted(map.closures));
    std::set<std::pair<std::size_t, std::size_t>> pairs;
    for (const Closure& closure : map.closures) {
        EXPECT_TRUE(pairs.emplace(closure.from, closure.to).second) << "listed twice";
    }
}

TEST(Slam, ClosuresThatDoNotFitAreThrownOutOfTheFinalSolution) {
    SlamConfig config = drifting_config();
    config.graph.outlier_chi2 = 1e-12;  // nothing fits this well
    const SlamMap map = drive_through(config, hall_drive().frames).map;
    EXPECT_EQ(closure_edges(map.graph), 0U);
    EXPECT_EQ(accepted(map.closures), 0U);
    EXPECT_GT(std::count_if(map.closures.begin(), map.closures.end(),
                            [](const Closure& closure) {
                                return closure.verdict == ClosureVerdict::kOutlier;
                            }),
              2);
    EXPECT_LT(worst_apart(map.trajectory, map.odometry_trajectory), 1e-3)
        << "the chain alone is left";
}

TEST(Slam, BlindFramesAreSurvived) {
    auto frames = first_of(hall_drive().frames, 120);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        if (i < 2 || (i > 60 && i < 70)) {
            const double stamp = frames[i].scan.stamp;
            frames[i].scan = blind_scan();
            frames[i].scan.stamp = stamp;
        }
    }
    SlamConfig config;
    config.odometry.prior.kind = PriorKind::kWheel;
    const SlamRun run = drive_through(config, frames);
    EXPECT_EQ(run.results[65].status, OdometryStatus::kPriorOnly);
    EXPECT_EQ(run.results[80].status, OdometryStatus::kAligned);
    const Trajectory& truth = hall_drive().truth;
    EXPECT_LT(apart(between(truth[0].pose, truth[119].pose), run.map.trajectory[119].pose), 0.2);
    for (const Edge& edge : run.map.graph.edges) {
        EXPECT_TRUE(edge.information.allFinite());
    }
}

// Edges hold their information in the axes of the newer node (as g2o does): in a corridor weak
// along the corridor as that node sees it, whichever way it has turned since the node before.
TEST(Slam, EdgesAreWeakAlongTheCorridorInTheAxesOfTheirNewerNode) {
    SlamConfig config;
    config.odometry.prior.kind = PriorKind::kWheel;
    config.odometry.keyframe.distance = 100.0;
    config.odometry.keyframe.angle = radians(45.0);
    Trajectory turn;
    for (int i = 0; i < 60; ++i) {
        turn.push_back({0.1 * i, {0.0, 0.1, radians(5.0 * i)}});
    }
    Lidar lidar;
    lidar.range_max = 12.0;
    lidar.sigma = 0.005;
    const SlamMap map =
        drive_through(config, frames_along(endless_corridor(), turn, lidar, 81)).map;
    ASSERT_GE(map.graph.edges.size(), 5U);
    for (const Edge& edge : map.graph.edges) {
        const Eigen::Matrix2d covariance = edge.information.inverse().topLeftCorner<2, 2>();
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(covariance);
        const Eigen::Vector2d weak = eigen.eigenvectors().col(1);
        const Eigen::Vector2d along =
            map.graph.nodes[edge.to].rotation().transpose() * Eigen::Vector2d::UnitX();
        EXPECT_GT(eigen.eigenvalues()(1), 4.0 * eigen.eigenvalues()(0));
        EXPECT_GT(std::abs(weak.dot(along)), std::cos(radians(10.0))) << "edge to " << edge.to;
    }
}

TEST(Slam, BeforeAnyFrameThereIsAnEmptyMap) {
    Slam slam(SlamConfig{});
    EXPECT_FALSE(slam.refine().usable);
    EXPECT_TRUE(slam.map().trajectory.empty());
    EXPECT_TRUE(slam.map().keyframes.empty());
    slam.process(hall_drive().frames[0]);
    EXPECT_EQ(slam.map().trajectory.size(), 1U);
    slam.refine();
    EXPECT_EQ(slam.map().graph.nodes.size(), 1U);
}

TEST(Slam, EveryKeyOfItsConfigurationIsListedOnce) {
    SlamConfig config;
    ConfigSchema schema;
    describe(schema, config);
    std::set<std::string> keys;
    for (const ConfigField& field : schema.fields()) {
        EXPECT_TRUE(keys.insert(field.key).second) << field.key << " twice";
        field.set(field.get());
    }
    for (const char* key :
         {"odometry.prior", "icp.metric", "loop_closing.min_score", "graph.enabled"}) {
        EXPECT_EQ(keys.count(key), 1U) << key;
    }
    schema.override_with("graph.enabled=false");
    EXPECT_FALSE(config.graph.enabled);
}

TEST(SlamOnWorlds, TheShippedHallEndsUpWithinCentimetres) {
    const auto file = std::filesystem::path(HYBRID_SLAM_SOURCE_DIR) / "config/worlds/hall.yaml";
    SimulatorConfig config;
    read_simulator_section(file, config);
    config.scan_rate = 4.0;
    Simulator simulator(read_world(file), config);
    const auto frames = frames_of(simulator);
    ASSERT_GT(frames.size(), 500U);
    SlamConfig slam_config;
    slam_config.odometry.prior.kind = PriorKind::kWheel;
    const SlamMap map = drive_through(slam_config, frames).map;
    EXPECT_LT(truth_error(map.trajectory, simulator.truth()).ate_rmse, 0.05);
}

TEST(SlamOnRecordings, MitCsailIsWithinWhatIsAsked) {
    HYBRID_SLAM_SHARED_OR_SKIP(file, "data/slam2d/mit-csail.clf.gz");
    HYBRID_SLAM_SHARED_OR_SKIP(relations_file, "data/slam2d/mit-csail.relations");
    CarmenLog log(file);
    const SlamMap map = drive_through({}, frames_of(log)).map;
    ASSERT_EQ(map.trajectory.size(), 1988U);
    const RelationsError error = relations_error(map.trajectory, read_relations(relations_file));
    EXPECT_EQ(error.unmatched, 0U);
    EXPECT_LT(error.translation.mean, 0.045);
    EXPECT_LT(degrees(error.rotation.mean), 1.1);
}

}  // namespace
}  // namespace hybrid_slam::test
