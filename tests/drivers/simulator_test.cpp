// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/simulator/simulator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "hybrid_slam/core/error.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

/// A room with a post, driven once around and, by a sharp turn, back to the start.
World make_room() {
    World world;
    world.name = "room";
    const Points corners{{-6, -4}, {6, -4}, {6, 4}, {-6, 4}};
    for (std::size_t i = 0; i < corners.size(); ++i) {
        world.walls.push_back({corners[i], corners[(i + 1) % corners.size()]});
    }
    world.posts.push_back({{0.5, 0.2}, 0.4});
    world.path = {{-4, -2}, {4, -2}, {4, 2}, {-4, 2}, {-4, -2}, {-4, 1}};
    return world;
}

SimulatorConfig without_noise() {
    SimulatorConfig config;
    config.range_sigma = 0.0;
    config.range_resolution = 0.0;
    config.dropout = 0.0;
    config.odometry_translation_sigma = 0.0;
    config.odometry_rotation_sigma = 0.0;
    config.odometry_drift_sigma = 0.0;
    return config;
}

struct Recorded {
    std::vector<Scan> scans;
    std::vector<WheelOdometry> odometry;
    Trajectory truth;
};

Recorded drive_through(const World& world, const SimulatorConfig& config) {
    Simulator simulator(world, config);
    Recorded result;
    while (std::optional<Measurement> measurement = simulator.next()) {
        if (const auto* odometry = std::get_if<WheelOdometry>(&*measurement)) {
            EXPECT_EQ(result.scans.size(), result.odometry.size())
                << "odometry, scan, odometry, ...";
            result.odometry.push_back(*odometry);
        } else {
            result.scans.push_back(std::get<Scan>(*measurement));
            EXPECT_EQ(simulator.truth().size(), result.scans.size());
        }
    }
    EXPECT_EQ(simulator.progress(), 1.0);
    result.truth = simulator.truth();
    return result;
}

TEST(Simulator, StampsRunEvenlyFromZeroAndAreTheSameOfScanOdometryAndTruth) {
    const Recorded drive = drive_through(make_room(), without_noise());
    ASSERT_GT(drive.scans.size(), 500U);
    ASSERT_EQ(drive.odometry.size(), drive.scans.size());
    for (std::size_t i = 0; i < drive.scans.size(); ++i) {
        ASSERT_NEAR(drive.scans[i].stamp, 0.08 * static_cast<double>(i), 1e-9);
        ASSERT_EQ(drive.odometry[i].stamp, drive.scans[i].stamp);
        ASSERT_EQ(drive.truth[i].stamp, drive.scans[i].stamp);
    }
}

TEST(Simulator, WithoutNoiseRangesAreTheExactRays) {
    const World world = make_room();
    for (const double field_of_view : {kPi, 2.0 * kPi, 0.5}) {
        SimulatorConfig config = without_noise();
        config.field_of_view = field_of_view;
        config.scan_rate = 2.0;
        const Recorded drive = drive_through(world, config);
        for (std::size_t i = 0; i < drive.scans.size(); ++i) {
            const Scan& scan = drive.scans[i];
            const Pose2d& world_from_robot = drive.truth[i].pose;
            ASSERT_NEAR(scan.angle_min, -field_of_view / 2.0, config.angle_increment / 2.0);
            for (std::size_t beam = 0; beam < scan.ranges.size(); ++beam) {
                const double angle = world_from_robot.heading + scan.angle(beam);
                const double exact = world.cast_ray(world_from_robot.translation,
                                                    {std::cos(angle), std::sin(angle)});
                ASSERT_NEAR(scan.ranges[beam], exact, 1e-5) << "scan " << i << " beam " << beam;
            }
        }
    }
}

TEST(Simulator, WithoutNoiseOdometryIsTheTruthSeenFromTheStart) {
    const Recorded drive = drive_through(make_room(), without_noise());
    const Pose2d start = drive.truth[0].pose;
    EXPECT_THAT(start, PoseNear(Pose2d(-4, -2, 0), 1e-12, 1e-12));
    for (std::size_t i = 0; i < drive.truth.size(); ++i) {
        ASSERT_THAT(start * drive.odometry[i].odom_from_robot,
                    PoseNear(drive.truth[i].pose, 1e-9, 1e-9));
    }
}

TEST(Simulator, DrivesSmoothlyNearThePathAndWithinTheLimits) {
    const SimulatorConfig config = without_noise();
    const World world = make_room();
    const Recorded drive = drive_through(world, config);
    const double step = 1.0 / config.scan_rate;
    for (std::size_t i = 1; i < drive.truth.size(); ++i) {
        const Pose2d motion = between(drive.truth[i - 1].pose, drive.truth[i].pose);
        ASSERT_LE(motion.translation.norm(), config.speed * step + 1e-9);
        ASSERT_LE(std::abs(motion.heading), config.turn_rate * step + 1e-9);
        ASSERT_LE(std::abs(motion.y()), 0.01 * step) << "sideways";
    }
    for (const Point2& point : world.path) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const StampedPose& pose : drive.truth) {
            nearest = std::min(nearest, (pose.pose.translation - point).norm());
        }
        EXPECT_LT(nearest, 0.3) << "corners are rounded, not cut";
    }
    EXPECT_LT((drive.truth.back().pose.translation - world.path.back()).norm(), 0.05);
}

TEST(Simulator, LapsRepeatThePathAndTheStartHeadingIsTurnedFrom) {
    World world = make_room();
    world.path = {{-4, -2}, {4, -2}, {4, 2}, {-4, 2}, {-4, -2}};
    const double once = drive_through(world, without_noise()).truth.back().stamp;
    world.laps = 3;
    world.start_heading = kPi / 2.0;
    const Recorded drive = drive_through(world, without_noise());
    EXPECT_THAT(drive.truth[0].pose, PoseNear(Pose2d(-4, -2, kPi / 2.0), 1e-12, 1e-12));
    EXPECT_NEAR(drive.truth.back().stamp, 3.0 * once, 15.0);
    EXPECT_LT((drive.truth.back().pose.translation - Point2(-4, -2)).norm(), 0.05);
}

TEST(Simulator, RangeNoiseHasTheMeanAndTheSigmaThatWereAskedFor) {
    const World world = make_room();
    SimulatorConfig config = without_noise();
    config.range_sigma = 0.03;
    config.scan_rate = 1.0;
    const Recorded noisy = drive_through(world, config);
    config.range_sigma = 0.0;
    const Recorded exact = drive_through(world, config);
    double sum = 0.0;
    double squares = 0.0;
    double count = 0.0;
    for (std::size_t i = 0; i < noisy.scans.size(); ++i) {
        for (std::size_t beam = 0; beam < noisy.scans[i].ranges.size(); ++beam) {
            const double error = noisy.scans[i].ranges[beam] - exact.scans[i].ranges[beam];
            sum += error;
            squares += error * error;
            count += 1.0;
        }
    }
    ASSERT_GT(count, 10000.0);
    EXPECT_LT(std::abs(sum / count), 4.0 * 0.03 / std::sqrt(count));
    EXPECT_NEAR(std::sqrt(squares / count), 0.03, 4.0 * 0.03 / std::sqrt(2.0 * count));
}

TEST(Simulator, DropoutsAndResolution) {
    SimulatorConfig config = without_noise();
    config.scan_rate = 1.0;
    config.dropout = 0.1;
    config.range_sigma = 0.02;
    config.range_resolution = 0.05;
    double beams = 0.0;
    double dropped = 0.0;
    for (const Scan& scan : drive_through(make_room(), config).scans) {
        for (const float range : scan.ranges) {
            beams += 1.0;
            dropped += scan.is_return(range) ? 0.0 : 1.0;
            const double steps = static_cast<double>(range) / 0.05;
            ASSERT_TRUE(std::isinf(range) || std::abs(steps - std::round(steps)) < 1e-4) << range;
        }
    }
    EXPECT_NEAR(dropped / beams, 0.1, 4.0 * std::sqrt(0.09 / beams));
}

TEST(Simulator, BeamsBeyondTheMaximumReturnNothing) {
    SimulatorConfig config = without_noise();
    config.range_max = 3.0;
    config.scan_rate = 1.0;
    std::size_t returns = 0;
    std::size_t none = 0;
    for (const Scan& scan : drive_through(make_room(), config).scans) {
        for (const float range : scan.ranges) {
            EXPECT_TRUE(range < 3.0F || std::isinf(range));
            ++(scan.is_return(range) ? returns : none);
        }
    }
    EXPECT_GT(returns, 1000U);
    EXPECT_GT(none, 1000U);
}

/// Over many seeds: the error of the distance after a straight line, which scale and noise cause.
TEST(Simulator, OdometryErrorsHaveTheSigmasThatWereAskedFor) {
    World world;
    world.path = {{0, 0}, {9, 0}};
    world.walls.push_back({{-1, -1}, {10, -1}});
    SimulatorConfig config = without_noise();
    config.scan_rate = 5.0;
    config.speed = 1.0;
    config.odometry_translation_sigma = 0.02;
    config.odometry_drift_sigma = 0.01;
    double distance_squares = 0.0;
    double heading_squares = 0.0;
    constexpr int kRuns = 400;
    for (config.seed = 1; config.seed <= kRuns; ++config.seed) {
        const Recorded drive = drive_through(world, config);
        const Pose2d end = drive.odometry.back().odom_from_robot;
        ASSERT_NEAR(drive.truth.back().pose.x(), 9.0, 1e-9);
        double driven = 0.0;
        for (std::size_t i = 1; i < drive.odometry.size(); ++i) {
            driven +=
                between(drive.odometry[i - 1].odom_from_robot, drive.odometry[i].odom_from_robot)
                    .x();
        }
        distance_squares += std::pow(driven - 9.0, 2);
        heading_squares += std::pow(end.heading, 2);
    }
    // Scale: 9 m * 0.02; noise: 0.02 m per sqrt(m) over 9 m. Heading: 0.01 rad per sqrt(m).
    EXPECT_NEAR(std::sqrt(distance_squares / kRuns), std::hypot(0.18, 0.06), 0.02);
    EXPECT_NEAR(std::sqrt(heading_squares / kRuns), 0.03, 0.004);
}

std::string bytes_of(const Recorded& drive) {
    std::string bytes;
    const auto add = [&bytes](const auto& value) {
        bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
    };
    for (std::size_t i = 0; i < drive.scans.size(); ++i) {
        for (const float range : drive.scans[i].ranges) {
            add(range);
        }
        add(drive.odometry[i].odom_from_robot.x());
        add(drive.odometry[i].odom_from_robot.y());
        add(drive.odometry[i].odom_from_robot.heading);
    }
    return bytes;
}

TEST(Simulator, SameSeedSameBytesOtherSeedOther) {
    SimulatorConfig config;
    config.scan_rate = 2.0;
    const std::string first = bytes_of(drive_through(make_room(), config));
    EXPECT_TRUE(first == bytes_of(drive_through(make_room(), config)));
    config.seed = 2;
    EXPECT_FALSE(first == bytes_of(drive_through(make_room(), config)));
}

TEST(Simulator, AnotherLidarDoesNotChangeTheOdometry) {
    SimulatorConfig config;
    const Recorded first = drive_through(make_room(), config);
    config.angle_increment *= 2.0;
    config.range_sigma = 0.05;
    const Recorded second = drive_through(make_room(), config);
    EXPECT_THAT(second.odometry.back().odom_from_robot,
                PoseNear(first.odometry.back().odom_from_robot, 0.0, 0.0));
}

TEST(Simulator, RefusesMisuse) {
    World world = make_room();
    SimulatorConfig config;
    config.speed = 0.0;
    EXPECT_THROW(Simulator(world, config), Error);
    config = {};
    config.range_sigma = std::nan("");
    EXPECT_THROW(Simulator(world, config), Error);
    world.path = {{1, 1}, {1, 1}};
    EXPECT_THROW(Simulator(world, {}), Error);
    world.path.clear();
    EXPECT_THROW(Simulator(world, {}), Error);
}

}  // namespace
}  // namespace hybrid_slam::test
