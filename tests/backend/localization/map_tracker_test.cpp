// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/localization/map_tracker.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "backend/localization/localization_support.hpp"
#include "hybrid_slam/core/uncertainty.hpp"
#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;

World hall() {
    World world = world_named("thesis_hall");
    world.laps = 1;
    return world;
}
std::shared_ptr<const ReferenceMap> hall_map() {
    static const auto map = map_of(hall());
    return map;
}

OdometryConfig by_wheels() {
    OdometryConfig config;
    config.prior.kind = PriorKind::kWheel;
    return config;
}

Eigen::Matrix3d start_covariance() {
    return Eigen::Vector3d(4e-4, 4e-4, 1e-4).asDiagonal();
}

/// Drawn from that covariance around the truth.
Pose2d start_near(const Pose2d& truth, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> unit;
    return {truth.x() + 0.02 * unit(random), truth.y() + 0.02 * unit(random),
            truth.heading + 0.01 * unit(random)};
}

struct Followed {
    std::vector<Track> tracks;
    std::vector<Eigen::Vector3d> errors;  ///< x, y, heading in the axes of the map

    double rmse(bool heading) const {
        double squares = 0.0;
        for (const Eigen::Vector3d& error : errors) {
            squares += heading ? error.z() * error.z() : error.head<2>().squaredNorm();
        }
        return std::sqrt(squares / static_cast<double>(errors.size()));
    }
    /// Mean normalised squared error of three degrees of freedom.
    double nees() const {
        double sum = 0.0;
        for (std::size_t i = 0; i < errors.size(); ++i) {
            sum += errors[i].dot(tracks[i].covariance.inverse() * errors[i]);
        }
        return sum / static_cast<double>(errors.size());
    }
    double mean(double ScanFit::*share) const {
        double sum = 0.0;
        for (const Track& track : tracks) {
            sum += track.fit.*share;
        }
        return sum / static_cast<double>(tracks.size());
    }
    bool has(TrackingStatus status) const {
        return std::any_of(tracks.begin(), tracks.end(),
                           [&](const Track& track) { return track.status == status; });
    }
};

Followed follow(const std::shared_ptr<const ReferenceMap>& map, const TestDrive& drive,
                const OdometryConfig& odometry_config = by_wheels(), unsigned seed = 1) {
    Odometry odometry(odometry_config);
    MapTracker tracker(map, TrackingConfig(), IcpConfig());
    tracker.start(start_near(drive.truth.front().pose, seed), start_covariance());
    Followed run;
    for (std::size_t i = 0; i < drive.frames.size(); ++i) {
        const Scan& scan = drive.frames[i].scan;
        run.tracks.push_back(tracker.track(scan.stamp, odometry.register_frame(drive.frames[i]),
                                           scan.robot_from_laser));
        run.errors.push_back(difference(run.tracks.back().map_from_robot, drive.truth[i].pose));
    }
    return run;
}

TestDrive first_of(TestDrive drive, std::size_t count) {
    drive.frames.resize(std::min(count, drive.frames.size()));
    drive.truth.resize(drive.frames.size());
    return drive;
}

TEST(MapTracker, KeepsThePlaceWithinMillimetresAtBothSpeeds) {
    for (const double speed : {0.3, 1.0}) {
        const Followed run = follow(hall_map(), drive_in(hall(), s300_config(speed)));
        EXPECT_LT(run.rmse(false), 0.005) << speed;
        EXPECT_LT(run.rmse(true), radians(0.06)) << speed;
        EXPECT_FALSE(run.has(TrackingStatus::kLost));
        EXPECT_FALSE(run.has(TrackingStatus::kDegraded));
    }
}

TEST(MapTracker, ItsCovarianceIsHonest) {
    double nees = 0.0;
    constexpr unsigned kRuns = 20;
    for (unsigned seed = 1; seed <= kRuns; ++seed) {
        const TestDrive drive =
            first_of(drive_in(hall(), s300_config(1.0, static_cast<int>(seed))), 60);
        nees += follow(hall_map(), drive, by_wheels(), seed).nees() / kRuns;
    }
    EXPECT_GT(nees, 1.5);  // the map of this test is better than most
    EXPECT_LT(nees, 4.0);
}

void add_box(World& world, const Point2& low, const Point2& high) {
    const Point2 right(high.x(), low.y());
    const Point2 left(low.x(), high.y());
    for (const Segment& side : {Segment{low, right}, {right, high}, {high, left}, {left, low}}) {
        world.walls.push_back(side);
    }
}

/// The hall with some things along its walls, a few touching them.
World furnished_hall() {
    World world = hall();
    add_box(world, {-3.0, -3.6}, {-0.5, -3.3});
    add_box(world, {4.5, -1.5}, {5.0, 1.5});
    add_box(world, {-5.0, -1.0}, {-4.9, 1.2});
    world.posts.push_back({{3.2, -2.9}, 0.15});
    return world;
}

World crowded_hall() {
    World world = furnished_hall();
    add_box(world, {1.0, -3.6}, {2.6, -3.0});
    add_box(world, {-2.0, 3.0}, {1.5, 3.6});
    add_box(world, {-0.8, -0.5}, {1.2, 0.4});
    world.posts.push_back({{-4.2, 2.0}, 0.2});
    world.posts.push_back({{2.4, 3.2}, 0.2});
    return world;
}

TEST(MapTracker, StaysTrueWithFortyPercentOfTheBeamsOnNewThings) {
    const Followed run = follow(hall_map(), drive_in(crowded_hall(), s300_config(0.5)));
    EXPECT_GT(run.mean(&ScanFit::unmapped), 0.4);
    EXPECT_LT(run.rmse(false), 0.01);
    EXPECT_LT(run.rmse(true), radians(0.15));
    EXPECT_FALSE(run.has(TrackingStatus::kLost));
}

TEST(MapTracker, StaysTrueWhereThingsAreGone) {
    const Followed run = follow(map_of(furnished_hall()), drive_in(hall(), s300_config(0.5)));
    EXPECT_GT(run.mean(&ScanFit::violated), 0.1);
    EXPECT_LT(run.rmse(false), 0.01);
    EXPECT_FALSE(run.has(TrackingStatus::kLost));
}

TEST(MapTracker, AlongACorridorItKnowsThatItKnowsLess) {
    World world;
    world.walls = {{{-100.0, -1.2}, {100.0, -1.2}}, {{100.0, 1.2}, {-100.0, 1.2}}};
    world.path = {{0.0, 0.0}, {12.0, 0.0}};
    OdometryConfig wheels = by_wheels();
    wheels.prior.wheel_translation_floor = 0.001;
    wheels.prior.wheel_translation_ratio = 0.05;
    const Followed run = follow(map_of(world), drive_in(world, s300_config(1.0)), wheels);
    const Track& last = run.tracks.back();
    EXPECT_EQ(run.tracks[0].status, TrackingStatus::kTracking);
    EXPECT_EQ(last.status, TrackingStatus::kDegraded);
    EXPECT_GT(std::abs(last.weak_direction.x()), 0.999);
    EXPECT_GT(std::sqrt(last.covariance(0, 0)), 0.1);
    EXPECT_GT(last.covariance(0, 0), 1.5 * run.tracks[run.tracks.size() / 4].covariance(0, 0));
    EXPECT_LT(std::sqrt(last.covariance(1, 1)), 0.005);
    EXPECT_LT(std::abs(run.errors.back().x()), 3.0 * std::sqrt(last.covariance(0, 0)));
    EXPECT_LT(std::abs(run.errors.back().y()), 0.01);
}

/// Seconds from a teleport during a drive until lost; empty when the drive was lost before.
std::optional<double> noticed_after(const Pose2d& there, unsigned seed) {
    constexpr std::size_t kBefore = 40;
    TestDrive drive =
        first_of(drive_in(hall(), s300_config(0.3, static_cast<int>(seed))), kBefore + 15);
    std::mt19937 random(seed);
    for (std::size_t i = kBefore; i < drive.frames.size(); ++i) {
        Scan scan = scan_at(hall(), there, random);
        scan.stamp = drive.frames[i].scan.stamp;
        drive.frames[i].scan = scan;
        drive.frames[i].odom_from_robot = drive.frames[kBefore - 1].odom_from_robot;
    }
    const Followed run = follow(hall_map(), drive);
    for (std::size_t i = 0; i < run.tracks.size(); ++i) {
        if (run.tracks[i].status == TrackingStatus::kLost) {
            return i < kBefore ? std::nullopt
                               : std::optional<double>(drive.frames[i].scan.stamp -
                                                       drive.frames[kBefore - 1].scan.stamp);
        }
    }
    return 100.0;
}

TEST(MapTracker, NoticesWithinASecondThatItWasCarriedAway) {
    const Pose2d here(-1.6, -1.6, 0.0);  // near where it is taken up
    unsigned seed = 1;
    for (const Pose2d& moved :
         {Pose2d(1.0, 0.0, 0.0), Pose2d(0.0, 1.0, 0.0), Pose2d(2.0, 1.0, 0.0),
          Pose2d(0.0, 0.0, radians(30.0)), Pose2d(0.0, 0.0, radians(-60.0)), Pose2d(0.0, 0.0, kPi),
          Pose2d(1.8, 3.2, kPi), Pose2d(3.0, 2.0, radians(90.0)), Pose2d(3.2, 3.2, kPi),
          Pose2d(-1.0, 2.5, 0.1)}) {
        const std::optional<double> seconds = noticed_after(here * moved, ++seed);
        ASSERT_TRUE(seconds.has_value()) << moved;
        EXPECT_LE(*seconds, 1.0) << moved;
    }
}

TEST(MapTracker, LostUntilItIsStartedAnew) {
    const TestDrive drive = first_of(drive_in(hall(), s300_config(0.3)), 40);
    Odometry odometry(by_wheels());
    MapTracker tracker(hall_map(), TrackingConfig(), IcpConfig());
    const Pose2d wrong = drive.truth.front().pose * Pose2d(1.0, 0.5, 0.4);
    tracker.start(wrong, start_covariance());
    Track track;
    for (std::size_t i = 0; i < 20; ++i) {
        track =
            tracker.track(drive.frames[i].scan.stamp, odometry.register_frame(drive.frames[i]), {});
    }
    EXPECT_EQ(track.status, TrackingStatus::kLost);
    EXPECT_FALSE(track.anchored);
    tracker.start(start_near(drive.truth[20].pose, 3), start_covariance());
    for (std::size_t i = 20; i < drive.frames.size(); ++i) {
        track =
            tracker.track(drive.frames[i].scan.stamp, odometry.register_frame(drive.frames[i]), {});
        EXPECT_EQ(track.status, TrackingStatus::kTracking);
    }
    EXPECT_THAT(track.map_from_robot, PoseNear(drive.truth.back().pose, 0.01, 0.003));
}

TEST(MapTracker, ALeapBeforeTheStartIsForgiven) {
    const TestDrive drive = first_of(drive_in(hall(), s300_config(0.3)), 4);
    Odometry odometry(by_wheels());
    MapTracker tracker(hall_map(), TrackingConfig(), IcpConfig());
    for (int start = 0; start < 2; ++start) {
        const auto first = static_cast<std::size_t>(2 * start);
        OdometryResult result = odometry.register_frame(drive.frames[first]);
        result.before_from_now = {3.0, 0.0, 0.0};
        tracker.start(drive.truth[first].pose, start_covariance());
        const double stamp = drive.frames[first].scan.stamp;
        EXPECT_EQ(tracker.track(stamp, result, {}).status, TrackingStatus::kTracking);
        result = odometry.register_frame(drive.frames[first + 1]);
        result.before_from_now = {3.0, 0.0, 0.0};
        EXPECT_EQ(tracker.track(stamp + 0.08, result, {}).status, TrackingStatus::kLost);
    }
}

TEST(MapTracker, BlindItGoesOnByOdometryAndFindsBack) {
    TestDrive drive = first_of(drive_in(hall(), s300_config(0.3)), 90);
    for (std::size_t i = 30; i < 60; ++i) {
        std::fill(drive.frames[i].scan.ranges.begin(), drive.frames[i].scan.ranges.end(), 100.0F);
    }
    const Followed run = follow(hall_map(), drive);
    EXPECT_FALSE(run.tracks[40].anchored);
    EXPECT_EQ(run.tracks[59].status, TrackingStatus::kDegraded);
    EXPECT_GT(run.tracks[59].covariance.trace(), 10.0 * run.tracks[29].covariance.trace());
    EXPECT_LT(run.errors[59].head<2>().norm(), 0.1);
    EXPECT_EQ(run.tracks.back().status, TrackingStatus::kTracking);
    EXPECT_LT(run.errors.back().head<2>().norm(), 0.01);
    EXPECT_FALSE(run.has(TrackingStatus::kLost));
}

TEST(MapTracker, TheSameDriveGivesTheSameBits) {
    const TestDrive drive = first_of(drive_in(crowded_hall(), s300_config(1.0)), 40);
    const Followed a = follow(hall_map(), drive);
    const Followed b = follow(hall_map(), drive);
    for (std::size_t i = 0; i < a.tracks.size(); ++i) {
        EXPECT_EQ(a.tracks[i].map_from_robot.vector(), b.tracks[i].map_from_robot.vector());
        EXPECT_EQ(a.tracks[i].covariance, b.tracks[i].covariance);
    }
}

TEST(MapTracker, NamesWhatItRefuses) {
    TrackingConfig config;
    config.gate = 0.0;
    EXPECT_THAT(error_of([&] { MapTracker(hall_map(), config, IcpConfig()); }),
                HasSubstr("tracking.gate"));
    config = TrackingConfig();
    config.window = 0;
    EXPECT_THAT(error_of([&] { MapTracker(hall_map(), config, IcpConfig()); }),
                HasSubstr("tracking.window"));
    IcpConfig icp;
    icp.max_iterations = 0;
    EXPECT_THAT(error_of([&] { MapTracker(hall_map(), TrackingConfig(), icp); }),
                HasSubstr("icp.max_iterations"));
    EXPECT_THAT(error_of([] { MapTracker(nullptr, TrackingConfig(), IcpConfig()); }),
                HasSubstr("map"));
    MapTracker tracker(hall_map(), TrackingConfig(), IcpConfig());
    EXPECT_THAT(error_of([&] { tracker.track(0.0, OdometryResult(), {}); }), HasSubstr("start"));
    EXPECT_THAT(error_of([&] { tracker.start({}, Eigen::Matrix3d::Constant(-1.0)); }),
                HasSubstr("covariance"));
}

}  // namespace
}  // namespace hybrid_slam::test
