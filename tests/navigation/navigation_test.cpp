// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <cmath>

#include "navigation/bus_log.hpp"
#include "navigation/tour.hpp"

/// The system test: truck and sensors, SLAM, drive and client as processes of their own, connected
/// as a user connects them.
namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;

constexpr double kPatience = 100.0;  ///< seconds of the wall clock

class Navigation : public ::testing::Test {
  protected:
    Navigation()
        : map_(make_loop_map(HYBRID_SLAM_PROGRAM,
                             HYBRID_SLAM_SOURCE_DIR "/config/worlds/thesis_hall.yaml",
                             folder_.path())) {}

    WorkFolder folder_;
    LoopMap map_;
};

struct Tour {
    TourResult result;
    std::string truth;
    std::string bus;
    int images = 0;
    std::string said;  ///< in case it fails
};

Tour drive_tour(const LoopMap& map, bool camera) {
    LoopOptions options;
    options.world_from_start = kTourStart;
    options.lockstep = true;
    options.camera = camera;
    options.duration = 36.0;
    ClosedLoop loop(map, options);
    loop.send_goals(kTourPlaces);
    const Trip trip = loop.wait_for_arrival(kPatience);
    EXPECT_EQ(loop.wait_for_end(kPatience), 0);
    return {judge_tour(loop, map, trip), contents_of(loop.folder() / "sim/truth.tum"),
            contents_of(loop.bus()), loop.summary()["images"].get<int>(),
            loop.drive().output() + loop.localize().output()};
}

void expect_as_asked(const Tour& tour) {
    const TourResult& result = tour.result;
    EXPECT_TRUE(result.arrived) << result.why << "\n" << tour.said;
    EXPECT_LT(result.slam.start, 0.01);
    EXPECT_LT(result.slam.first, 0.01);
    EXPECT_LT(result.slam.second, 0.01);
    EXPECT_LT(result.missed, 0.02);
    EXPECT_LT(result.passed, 0.05);
    EXPECT_EQ(result.contacts, 0);
}

TEST_F(Navigation, TheTourOfTheThesisIsDrivenToTheCentimetreAndTheSameAgain) {
    const Tour first = drive_tour(map_, false);
    expect_as_asked(first);
    EXPECT_EQ(first.images, 0);
    const Tour again = drive_tour(map_, false);
    EXPECT_FALSE(first.truth.empty());
    EXPECT_TRUE(first.truth == again.truth);
    EXPECT_TRUE(first.bus == again.bus);
}

TEST_F(Navigation, TheTourOfTheThesisWithTheCameraToo) {
    const Tour tour = drive_tour(map_, true);
    expect_as_asked(tour);
    EXPECT_GT(tour.images, 500);
}

/// What the benchmark holds beside is a drive of the same bytes.
TEST_F(Navigation, ADriveCanBeRecordedAgainFromItsBus) {
    LoopOptions options;
    options.lockstep = true;
    options.seed = 3;
    options.duration = 12.0;
    ClosedLoop loop(map_, options);
    loop.send_goals({{2.4, 1.2}});
    loop.wait_for_end(kPatience);
    const auto out = folder_.path() / "again";
    record_again(loop, map_, options.seed, out);  // throws when it ends elsewhere
    EXPECT_GT(loop.summary()["distance_m"].get<double>(), 1.0);
    ASSERT_EQ(run_process({map_.program, "localize", map_.folder, out, "--out", "again_run", "-q"},
                          folder_.path(), folder_.path() / "said.txt"),
              0)
        << contents_of(folder_.path() / "said.txt");
    const Trajectory live = loop.published();
    const Trajectory again = read_tum(folder_.path() / "again_run/trajectory.tum");
    ASSERT_NEAR(static_cast<double>(live.size()), static_cast<double>(again.size()), 2.0);
    EXPECT_LT((live.back().pose.translation - again.back().pose.translation).norm(), 0.01);
}

/// Two of the benchmark's hundred.
class RandomTrips : public Navigation, public ::testing::WithParamInterface<int> {};

TEST_P(RandomTrips, FromAnUnknownPlaceToTwoOthersWithoutTouchingAnything) {
    const World world = read_world(map_.world);
    const Pose2d starts[] = {{-2.0, 0.3, 2.1}, {1.6, -0.9, -1.2}};
    const std::vector<Eigen::Vector2d> places[] = {{{1.8, 0.6}, {-0.4, -1.2}},
                                                   {{-1.9, 0.8}, {0.9, 1.4}}};
    const auto which = static_cast<std::size_t>(GetParam());
    ASSERT_GT(true_clearance(world, VehicleConfig(), starts[which]), 0.5);
    LoopOptions options;
    options.world_from_start = starts[which];
    options.lockstep = true;
    options.seed = 11 + GetParam();
    ClosedLoop loop(map_, options);
    loop.send_goals(places[which]);
    const Trip trip = loop.wait_for_arrival(kPatience);
    EXPECT_EQ(loop.end(), 0);
    EXPECT_EQ(trip.end, TripEnd::kArrived) << trip.why << loop.drive().output();
    EXPECT_LT((loop.truth().back().pose.translation - places[which].back()).norm(), 0.03);
    EXPECT_EQ(loop.summary()["contacts"], 0);
}

INSTANTIATE_TEST_SUITE_P(Two, RandomTrips, ::testing::Values(0, 1));

/// `goto` as a user types it. In real time: what it says depends on when it looks.
TEST_F(Navigation, GotoTellsByItsCodeHowItEnded) {
    ClosedLoop loop(map_, {});
    EXPECT_EQ(loop.visit({loop.place({1.0, 1.6}), "--watch"}), 0) << loop.visit_said();
    EXPECT_THAT(loop.visit_said(), HasSubstr("arrived"));
    EXPECT_EQ(loop.visit({loop.place({30.0, 1.6}), "--watch"}), 1);
    EXPECT_THAT(loop.visit_said(), HasSubstr("refused: "));
    EXPECT_EQ(loop.visit({"nowhere"}), 2);
    EXPECT_EQ(loop.end(), 0);
    EXPECT_EQ(loop.summary()["contacts"], 0);
    EXPECT_NEAR((loop.truth().back().pose.translation - Eigen::Vector2d(1.0, 1.6)).norm(), 0, 0.03);
}

void expect_standing(ClosedLoop& loop, LinkDriveState state) {
    loop.listen(1.5);  // 0.3 m/s are braked away in 0.6 s
    EXPECT_EQ(loop.status().state, state) << loop.status().reason;
    EXPECT_NEAR(loop.status().speed, 0.0, 1e-6);
}

TEST_F(Navigation, PauseResumeAndCancelThroughAllProcesses) {
    ClosedLoop loop(map_, {});
    loop.send_goals(kTourPlaces);
    ASSERT_TRUE(loop.wait_for_speed(0.2, kPatience)) << loop.drive().output();
    EXPECT_EQ(loop.visit({"--pause"}), 0) << loop.visit_said();
    expect_standing(loop, LinkDriveState::kPaused);
    EXPECT_GT(loop.status().waypoints_left, 0);
    EXPECT_EQ(loop.visit({"--resume"}), 0) << loop.visit_said();
    ASSERT_TRUE(loop.wait_for_speed(0.2, kPatience)) << loop.drive().output();
    EXPECT_EQ(loop.visit({"--cancel"}), 0) << loop.visit_said();
    expect_standing(loop, LinkDriveState::kIdle);
    EXPECT_EQ(loop.status().waypoints_left, 0);
    EXPECT_EQ(loop.end(), 0);
}

/// Section 3.2.2: who drives by hand is not spoken to.
TEST_F(Navigation, InManualModeNothingIsSent) {
    ClosedLoop loop(map_, {});
    loop.send_goals(kTourPlaces);
    ASSERT_TRUE(loop.wait_for_speed(0.2, kPatience)) << loop.drive().output();
    EXPECT_EQ(loop.visit({"--manual"}), 0) << loop.visit_said();
    loop.listen(2.0);
    EXPECT_EQ(loop.status().mode, LinkMode::kManual);
    EXPECT_NEAR(loop.status().speed, 0.0, 1e-6);
    const std::int64_t from = wall_microseconds();
    EXPECT_EQ(loop.visit({loop.place({1.0, 1.6})}), 1) << "nothing drives there by itself";
    loop.listen(0.5);
    const std::int64_t until = wall_microseconds();
    EXPECT_EQ(loop.visit({"--automatic"}), 0) << loop.visit_said();
    loop.send_goals({{1.4, 1.0}});
    EXPECT_TRUE(loop.wait_for_speed(0.1, kPatience)) << loop.drive().output();
    EXPECT_EQ(loop.end(), 0);
    int commands = 0;
    int silent = 0;
    for (const BusMoment& moment : read_bus(loop.bus())) {
        const bool in_manual = moment.wall > from && moment.wall < until;
        silent += moment.is_command && in_manual ? 1 : 0;
        commands += moment.is_command && !in_manual ? 1 : 0;
    }
    EXPECT_EQ(silent, 0);
    EXPECT_GT(commands, 50);
}

}  // namespace
}  // namespace hybrid_slam::test
