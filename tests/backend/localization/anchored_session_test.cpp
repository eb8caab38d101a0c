// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/localization/anchored_session.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "hybrid_slam/core/error.hpp"
#include "localization_support.hpp"
#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

/// A drive that was mapped, with what is true of it.
struct Session {
    SlamMap map;
    Trajectory truth;  ///< world_from_robot
};

Session session_in(World world, const Points& path, int seed, double range_max = 29.5) {
    world.path = path;
    world.laps = 1;
    SimulatorConfig config = s300_config(0.5, seed);
    config.scan_rate = 5.0;
    config.range_max = range_max;
    const TestDrive drive = drive_in(world, config);
    Slam slam((SlamConfig()));
    for (const Frame& frame : drive.frames) {
        slam.process(frame);
    }
    slam.refine();
    return {slam.map(), drive.truth};
}

/// As if written to disk and read again.
StoredMap stored(const SlamMap& map) {
    StoredMap result;
    result.keyframes = map.keyframes;
    result.graph = map.graph;
    result.trajectory = map.trajectory;
    result.grid = to_states(draw_grid(map.keyframes, map.graph));
    return result;
}

Anchoring anchor(const StoredMap& map, const SlamMap& session, const AnchoringConfig& config = {}) {
    return SessionAnchorer(reference_of(map), config, RelocalizationConfig(), IcpConfig())
        .anchor(session);
}

void add_box(World& world, const Point2& center, double length, double width) {
    const Point2 half(0.5 * length, 0.5 * width);
    const Points corners{center - half, center + Point2(half.x(), -half.y()), center + half,
                         center + Point2(-half.x(), half.y())};
    for (std::size_t i = 0; i < 4; ++i) {
        world.walls.push_back({corners[i], corners[(i + 1) % 4]});
    }
}

/// Around the thesis's hall, and across it the other way round.
const Points kFirstPath{{-3.0, -1.6}, {3.0, -1.6}, {3.0, 1.6}, {-3.0, 1.6}, {-3.0, -1.6}};
const Points kSecondPath{{2.0, 1.0}, {-2.8, 1.2}, {-2.0, -1.8}, {2.8, -1.2}, {2.0, 1.0}};

double rms_error(const Trajectory& found, std::size_t from, const Trajectory& truth,
                 const Pose2d& world_from_map) {
    double squares = 0.0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        squares += (world_from_map * found[from + i].pose.translation - truth[i].pose.translation)
                       .squaredNorm();
    }
    return std::sqrt(squares / static_cast<double>(truth.size()));
}

double worst_heading(const Trajectory& found, std::size_t from, const Trajectory& truth,
                     const Pose2d& world_from_map) {
    double worst = 0.0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        const Pose2d off = between(truth[i].pose, world_from_map * found[from + i].pose);
        worst = std::max(worst, std::abs(off.heading));
    }
    return worst;
}

bool is_wall_near(const StateGrid& grid, const Point2& place) {
    const Cell middle = grid.geometry.cell_of(place);
    bool wall = false;
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            wall = wall || grid.at({middle.x + x, middle.y + y}) == CellState::kOccupied;
        }
    }
    return wall;
}

class TwoSessions : public ::testing::Test {
  protected:
    static void SetUpTestSuite() {
        first_ = new Session(session_in(world_named("thesis_hall"), kFirstPath, 1));
        second_ = new Session(session_in(world_named("thesis_hall"), kSecondPath, 2));
    }
    static void TearDownTestSuite() {
        delete first_;
        delete second_;
    }

    static Pose2d world_from_map() { return first_->truth.front().pose; }

    static const Session* first_;
    static const Session* second_;
};
const Session* TwoSessions::first_ = nullptr;
const Session* TwoSessions::second_ = nullptr;

TEST_F(TwoSessions, BecomeOneMapWithBothInTheirPlaces) {
    const StoredMap map = stored(first_->map);
    const Anchoring anchoring = anchor(map, second_->map);
    ASSERT_EQ(anchoring.verdict, AnchoringVerdict::kAnchored);
    EXPECT_EQ(anchoring.anchors.size(), second_->map.keyframes.size());
    EXPECT_EQ(anchoring.count(AnchorVerdict::kAccepted), anchoring.anchors.size());
    const MergedMap merged = merge(map, second_->map, anchoring);
    const std::size_t scans = first_->truth.size();
    ASSERT_EQ(merged.map.trajectory.size(), scans + second_->truth.size());
    const double before = rms_error(first_->map.trajectory, 0, first_->truth, world_from_map());
    EXPECT_EQ(rms_error(merged.map.trajectory, 0, first_->truth, world_from_map()), before);
    EXPECT_LT(rms_error(merged.map.trajectory, scans, second_->truth, world_from_map()), 0.01);
    EXPECT_LT(worst_heading(merged.map.trajectory, scans, second_->truth, world_from_map()),
              radians(0.3));
    EXPECT_LT(merged.gone_points, 50U) << "nothing moved, and there are 20,000 points";
}

TEST_F(TwoSessions, MakeAGraphInOnePieceThatHoldsStill) {
    const StoredMap map = stored(first_->map);
    const Anchoring anchoring = anchor(map, second_->map);
    const MergedMap merged = merge(map, second_->map, anchoring);
    const std::size_t offset = map.graph.nodes.size();
    const PoseGraph& graph = merged.map.graph;
    ASSERT_EQ(graph.nodes.size(), offset + second_->map.graph.nodes.size());
    EXPECT_EQ(merged.map.keyframes.size(), graph.nodes.size());
    EXPECT_EQ(graph.edges.size(), map.graph.edges.size() + second_->map.graph.edges.size() +
                                      anchoring.count(AnchorVerdict::kAccepted));
    for (std::size_t i = 0; i < offset; ++i) {
        ASSERT_EQ(graph.nodes[i].vector(), map.graph.nodes[i].vector());
    }
    std::size_t ties = 0;
    for (const Edge& edge : graph.edges) {
        ASSERT_LT(edge.from, edge.to);
        ties += edge.from < offset && edge.to >= offset ? 1 : 0;
    }
    EXPECT_EQ(ties, anchoring.count(AnchorVerdict::kAccepted));
    // What anchored the session holds it there when all of the map is solved once more.
    PoseGraph again = graph;
    OptimizeOptions options;
    options.start = LinearStart::kNone;
    options.closure_kernel = RobustKernel::kCauchy;
    options.kernel_scale = AnchoringConfig().kernel_scale;
    ASSERT_TRUE(optimize(again, options).usable);
    for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
        ASSERT_THAT(again.nodes[i], PoseNear(graph.nodes[i], 0.02, radians(0.3))) << i;
    }
    // Paths go on, odometry is told in the frame of the map.
    const Keyframe& next = merged.map.keyframes[offset];
    EXPECT_GE(next.path, merged.map.keyframes[offset - 1].path);
    EXPECT_THAT(next.local_from_robot, PoseNear(graph.nodes[offset], 1e-12, 1e-12));
}

TEST_F(TwoSessions, GiveTheSameMapEachTime) {
    const StoredMap map = stored(first_->map);
    const Anchoring a = anchor(map, second_->map);
    const Anchoring b = anchor(map, second_->map);
    ASSERT_EQ(a.nodes.size(), b.nodes.size());
    for (std::size_t i = 0; i < a.nodes.size(); ++i) {
        ASSERT_EQ(a.nodes[i].vector(), b.nodes[i].vector());
    }
}

TEST_F(TwoSessions, EachScanFollowsItsKeyframe) {
    const StoredMap map = stored(first_->map);
    const Anchoring anchoring = anchor(map, second_->map);
    const MergedMap merged = merge(map, second_->map, anchoring);
    const std::size_t scans = map.trajectory.size();
    std::size_t next = 0;
    for (std::size_t i = scans; i < merged.map.trajectory.size(); ++i) {
        const StampedPose& scan = merged.map.trajectory[i];
        if (next < anchoring.nodes.size() && scan.stamp == second_->map.keyframes[next].stamp) {
            ASSERT_THAT(scan.pose, PoseNear(anchoring.nodes[next], 1e-9, 1e-9));
            ++next;
        }
        const StampedPose& before = merged.map.trajectory[i - 1];
        if (i > scans) {
            ASSERT_LT(between(before.pose, scan.pose).translation.norm(), 0.15) << "no jumps";
        }
    }
    EXPECT_EQ(next, anchoring.nodes.size());
}

/// The keyframe as if the vehicle had stood a hand's breadth beside its way: its scan fits the map
/// as well as any, but there.
SlamMap with_a_step_aside(SlamMap session, std::size_t keyframe) {
    Surface& surface = session.keyframes[keyframe].surface;
    surface = transform(Pose2d(0.1, 0.1, 0.0), surface);
    return session;
}

TEST_F(TwoSessions, AScanThatFitsElsewhereIsThrownOut) {
    const StoredMap map = stored(first_->map);
    const std::size_t odd = second_->map.keyframes.size() / 2;
    const Anchoring clean = anchor(map, second_->map);
    const Anchoring anchoring = anchor(map, with_a_step_aside(second_->map, odd));
    ASSERT_EQ(anchoring.verdict, AnchoringVerdict::kAnchored);
    EXPECT_EQ(anchoring.anchors[odd].verdict, AnchorVerdict::kDisagreeing);
    EXPECT_GT(anchoring.anchors[odd].chi2, AnchoringConfig().max_chi2);
    EXPECT_EQ(anchoring.count(AnchorVerdict::kAccepted), anchoring.anchors.size() - 1);
    for (std::size_t i = 0; i < clean.nodes.size(); ++i) {
        ASSERT_THAT(anchoring.nodes[i], PoseNear(clean.nodes[i], 0.003, radians(0.05))) << i;
    }
    // One such anchor that is kept bends the session, but for the kernel.
    AnchoringConfig kept;
    kept.max_chi2 = 1e9;
    kept.kernel_scale = 100.0;
    const Anchoring bent = anchor(map, with_a_step_aside(second_->map, odd), kept);
    ASSERT_EQ(bent.verdict, AnchoringVerdict::kAnchored);
    EXPECT_GT((bent.nodes[odd].translation - clean.nodes[odd].translation).norm(), 0.01);
}

TEST_F(TwoSessions, PlacesWithoutScansThatFitAreNotEnough) {
    AnchoringConfig strict;
    strict.max_violated = 0.0;
    strict.min_explained = 1.0;
    strict.min_agreement = 1.0;
    World after = world_named("thesis_hall");
    add_box(after, {0.0, 0.0}, 1.0, 0.6);
    const Session second = session_in(after, kFirstPath, 11);
    const Anchoring anchoring = anchor(stored(first_->map), second.map, strict);
    EXPECT_EQ(anchoring.verdict, AnchoringVerdict::kContradictory);
    EXPECT_FALSE(anchoring.anchors.empty());
    EXPECT_TRUE(anchoring.nodes.empty());
}

/// The first keyframes alone, as if the drive had ended there.
SlamMap beginning(const SlamMap& session, std::size_t keyframes) {
    SlamMap part;
    part.keyframes.assign(session.keyframes.begin(),
                          session.keyframes.begin() + static_cast<std::ptrdiff_t>(keyframes));
    part.graph.nodes.assign(session.graph.nodes.begin(),
                            session.graph.nodes.begin() + static_cast<std::ptrdiff_t>(keyframes));
    for (const Edge& edge : session.graph.edges) {
        if (edge.from < keyframes && edge.to < keyframes) {
            part.graph.edges.push_back(edge);
        }
    }
    for (std::size_t i = 0; session.trajectory[i].stamp < session.keyframes[keyframes].stamp; ++i) {
        part.trajectory.push_back(session.trajectory[i]);
        part.odometry_trajectory.push_back(session.odometry_trajectory[i]);
    }
    return part;
}

TEST_F(TwoSessions, AVehicleThatStandsStillIsPlacedToo) {
    const StoredMap map = stored(first_->map);
    const SlamMap session = beginning(second_->map, 1);
    const Anchoring anchoring = anchor(map, session);
    ASSERT_EQ(anchoring.verdict, AnchoringVerdict::kAnchored);
    const MergedMap merged = merge(map, session, anchoring);
    EXPECT_THAT(world_from_map() * merged.map.trajectory.back().pose,
                PoseNear(second_->truth[session.trajectory.size() - 1].pose, 0.02, radians(0.3)));
}

TEST_F(TwoSessions, PlacesThatDoNotTellOneStoryAreNotBelieved) {
    // Two drives put one after the other as if they were one: the way between them is wrong.
    SlamMap session = beginning(second_->map, 16);
    const SlamMap again = session;
    const std::size_t half = session.keyframes.size();
    for (std::size_t k = 0; k < half; ++k) {
        session.keyframes.push_back(again.keyframes[k]);
        session.keyframes.back().path += 20.0;
        session.graph.nodes.push_back(Pose2d(9.0, 4.0, 2.0) * again.graph.nodes[k]);
    }
    const Anchoring anchoring = anchor(stored(first_->map), session);
    EXPECT_EQ(anchoring.verdict, AnchoringVerdict::kContradictory);
    EXPECT_TRUE(anchoring.anchors.empty());
}

TEST_F(TwoSessions, AnEmptyOrUnanchoredSessionIsNotMerged) {
    const StoredMap map = stored(first_->map);
    EXPECT_EQ(error_of([&] { merge(map, second_->map, Anchoring()); }),
              "map: a session that is not anchored cannot be merged");
    AnchoringConfig config;
    config.query_path = -1.0;
    EXPECT_NE(error_of([&] { anchor(map, second_->map, config); }).find("query_path"),
              std::string::npos);
}

TEST(AnchoredSession, AMovedBoxDisagreesAndBendsNothing) {
    // A long box right beside the way, which is then pushed along and aside.
    World before = world_named("thesis_hall");
    World after = before;
    add_box(before, {0.0, 0.0}, 2.4, 0.8);
    add_box(after, {0.35, 0.25}, 2.4, 0.8);
    add_box(after, {-4.2, 0.0}, 0.8, 0.8);
    const Session first = session_in(before, kFirstPath, 3);
    Points way = kFirstPath;
    std::reverse(way.begin(), way.end());
    std::rotate(way.begin(), way.begin() + 2, way.end() - 1);
    way.back() = way.front();
    const Session second = session_in(after, way, 4);
    const StoredMap map = stored(first.map);
    const Anchoring anchoring = anchor(map, second.map);
    ASSERT_EQ(anchoring.verdict, AnchoringVerdict::kAnchored);
    EXPECT_GT(anchoring.count(AnchorVerdict::kContradicted) +
                  anchoring.count(AnchorVerdict::kDisagreeing),
              0U);
    const MergedMap merged = merge(map, second.map, anchoring);
    const Pose2d world_from_map = first.truth.front().pose;
    EXPECT_LT(rms_error(merged.map.trajectory, first.truth.size(), second.truth, world_from_map),
              0.02);
    // Where the box was, and nothing is now, is free.
    EXPECT_GT(merged.gone_points, 100U);
    const StateGrid grid = to_states(draw_grid(merged.map.keyframes, merged.map.graph));
    const Pose2d map_from_world = world_from_map.inverse();
    EXPECT_TRUE(is_wall_near(map.grid, map_from_world * Point2(-0.6, -0.4)));
    EXPECT_FALSE(is_wall_near(grid, map_from_world * Point2(-0.6, -0.4)));
    EXPECT_FALSE(is_wall_near(map.grid, map_from_world * Point2(1.4, 0.65)));
    EXPECT_TRUE(is_wall_near(grid, map_from_world * Point2(1.4, 0.65)));
}

TEST(AnchoredSession, ASessionInAnotherHallIsRefused) {
    const Session first = session_in(world_named("thesis_hall"), kFirstPath, 5);
    World other;
    other.walls = {{{-6, -4}, {5, -5}},
                   {{5, -5}, {7, 0}},
                   {{7, 0}, {2, 6}},
                   {{2, 6}, {-5, 4}},
                   {{-5, 4}, {-6, -4}}};
    add_box(other, {-1.0, 3.0}, 1.5, 0.7);
    const Session second = session_in(other, {{-3, -2}, {3, -2}, {3, 1}, {-3, 1}, {-3, -2}}, 6);
    const Anchoring anchoring = anchor(stored(first.map), second.map);
    EXPECT_NE(anchoring.verdict, AnchoringVerdict::kAnchored) << to_string(anchoring.verdict);
    EXPECT_FALSE(anchoring.searches.empty());
    EXPECT_TRUE(anchoring.nodes.empty());
}

TEST(AnchoredSession, LookAlikePlacesAreNeverBelieved) {
    World square;
    square.walls = {{{-4, -4}, {4, -4}}, {{4, -4}, {4, 4}}, {{4, 4}, {-4, 4}}, {{-4, 4}, {-4, -4}}};
    const Points way{{-2, -2}, {2, -2}, {2, 2}, {-2, 2}, {-2, -2}};
    const Session first = session_in(square, way, 7);
    const Session second = session_in(square, {{2, 2}, {-2, 2}, {-2, -2}, {2, -1}}, 8);
    const Anchoring anchoring = anchor(stored(first.map), second.map);
    EXPECT_EQ(anchoring.verdict, AnchoringVerdict::kAmbiguous);
}

TEST(AnchoredSession, GoesOnBeyondTheBorderOfTheMap) {
    const World hall = world_named("hall");
    constexpr double kReach = 9.0;
    const Session first = session_in(
        hall, {{3.5, 3.5}, {14.0, 3.3}, {14.0, 3.9}, {3.6, 4.2}, {2.6, 7.0}, {3.6, 12.0}}, 9,
        kReach);
    const Session second = session_in(
        hall, {{5.0, 3.5}, {19.0, 3.2}, {34.5, 3.6}, {34.5, 7.0}, {33.5, 3.4}, {8.0, 3.4}}, 10,
        kReach);
    const StoredMap map = stored(first.map);
    const Anchoring anchoring = anchor(map, second.map);
    ASSERT_EQ(anchoring.verdict, AnchoringVerdict::kAnchored);
    EXPECT_GT(anchoring.count(AnchorVerdict::kOutside), 20U);
    EXPECT_GT(anchoring.count(AnchorVerdict::kAccepted), 20U);
    const MergedMap merged = merge(map, second.map, anchoring);
    const Pose2d world_from_map = first.truth.front().pose;
    double inside = 0.0;
    double outside = 0.0;
    for (std::size_t i = 0; i < second.truth.size(); ++i) {
        const Pose2d& truth = second.truth[i].pose;
        const Pose2d found = world_from_map * merged.map.trajectory[first.truth.size() + i].pose;
        double& worst = truth.x() < 14.0 ? inside : outside;
        worst = std::max(worst, (found.translation - truth.translation).norm());
    }
    EXPECT_LT(inside, 0.05);
    EXPECT_LT(outside, 0.1) << "20 m beyond of what holds it";
}

}  // namespace
}  // namespace hybrid_slam::test
