// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/simulator/simulated_vehicle.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "hybrid_slam/sensors/sensor_source.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;

World room() {
    World world;
    world.name = "room";
    const Points corners{{-5, -4}, {5, -4}, {5, 4}, {-5, 4}};
    for (std::size_t i = 0; i < 4; ++i) {
        world.walls.push_back({corners[i], corners[(i + 1) % 4]});
    }
    world.posts.push_back({{-2.0, 2.0}, 0.3});
    world.path = {{-2, -1}, {2, -1}, {2, 1.5}};
    world.paths["back"] = {{2, 1}, {-2, 1}};
    return world;
}

/// Without noise, so that scans can be held against the world to the centimetre.
SimulatedDriveConfig clean() {
    SimulatedDriveConfig config;
    config.speed = 1.0;
    config.range_sigma = 0.0;
    config.dropout = 0.0;
    config.lidar_jitter = 0.0;
    config.camera = false;
    return config;
}

std::vector<Scan> scans_of(SimulatedVehicle& vehicle, const RobotConfig& robot) {
    SensorSource source(vehicle, robot);
    std::vector<Scan> scans;
    while (auto measurement = source.next()) {
        scans.push_back(std::get<Scan>(std::move(*measurement)));
    }
    return scans;
}

/// The largest difference between ranges and what each beam must see from where the robot truly is
/// at the time of the beam, by the truth's own interpolation.
double worst_range_error(const World& world, const Scan& scan, const Trajectory& truth) {
    const TrajectoryIndex index(truth);
    double worst = 0.0;
    for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
        const double time = scan.stamp + static_cast<double>(i) * scan.time_increment;
        const auto robot = index.interpolated(time, 0.2);
        if (!robot) {
            continue;
        }
        const Pose2d laser = *robot * scan.robot_from_laser;
        const double angle = laser.heading + scan.angle(i);
        const double range = world.cast_ray(laser.translation, {std::cos(angle), std::sin(angle)});
        const double error = std::abs(range - static_cast<double>(scan.ranges[i]));
        // Next to an edge a beam may go either way, and along a wall a hair of heading is far.
        const double lower =
            world.cast_ray(laser.translation, {std::cos(angle - 0.004), std::sin(angle - 0.004)});
        const double upper =
            world.cast_ray(laser.translation, {std::cos(angle + 0.004), std::sin(angle + 0.004)});
        if (std::abs(lower - range) < 0.03 && std::abs(upper - range) < 0.03) {
            worst = std::max(worst, error);
        }
    }
    return worst;
}

TEST(SimulatedVehicle, ItsBytesAreTheScansOfItsTruth) {
    const World world = room();
    for (const bool upside_down : {false, true}) {
        RobotConfig robot;
        robot.lidar.upside_down = upside_down;
        robot.lidar.yaw = 0.3;
        robot.lidar.angle_offset = radians(10.0);
        robot.lidar.y = -0.2;
        SimulatedVehicle vehicle(world, "", robot, clean());
        const std::vector<Scan> scans = scans_of(vehicle, robot);
        ASSERT_EQ(scans.size(), vehicle.truth().size());
        ASSERT_GT(scans.size(), 60U);
        for (std::size_t i = 20; i + 2 < scans.size(); ++i) {
            EXPECT_NEAR(scans[i].stamp, vehicle.truth()[i].stamp, 1e-4);
            EXPECT_LT(worst_range_error(world, scans[i], vehicle.truth()), 0.02) << i;
        }
    }
}

TEST(SimulatedVehicle, NoiseIsAsConfigured) {
    SimulatedDriveConfig config = clean();
    config.range_sigma = 0.02;
    config.range_bias = -0.015;
    config.dropout = 0.01;
    World world = room();
    const RobotConfig robot;
    SimulatedVehicle noisy(world, "", robot, config);
    SimulatedVehicle exact(world, "", robot, clean());
    const std::vector<Scan> noisy_scans = scans_of(noisy, robot);
    const std::vector<Scan> exact_scans = scans_of(exact, robot);
    ASSERT_EQ(noisy_scans.size(), exact_scans.size());
    double sum = 0.0;
    double squares = 0.0;
    std::size_t returns = 0;
    std::size_t beams = 0;
    for (std::size_t i = 0; i < noisy_scans.size(); ++i) {
        for (std::size_t j = 0; j < noisy_scans[i].ranges.size(); ++j) {
            ++beams;
            if (noisy_scans[i].is_return(noisy_scans[i].ranges[j])) {
                const double error = noisy_scans[i].ranges[j] - exact_scans[i].ranges[j];
                sum += error;
                squares += error * error;
                ++returns;
            }
        }
    }
    const auto count = static_cast<double>(returns);
    EXPECT_NEAR(sum / count, -0.015, 5e-4);
    EXPECT_NEAR(std::sqrt(squares / count - std::pow(sum / count, 2)), 0.02, 1e-3)
        << "rounding to centimetres, twice, adds 4 mm";
    EXPECT_NEAR(1.0 - count / static_cast<double>(beams), 0.01, 0.002);
}

std::vector<SensorEvent> events_of(const SimulatedDriveConfig& config, const RobotConfig& robot) {
    SimulatedVehicle vehicle(room(), "back", robot, config);
    std::vector<SensorEvent> events;
    while (auto event = vehicle.next()) {
        events.push_back(std::move(*event));
    }
    return events;
}

/// A small image, so that the test is quick.
RobotConfig small_camera() {
    RobotConfig robot;
    robot.camera.model.width = 160;
    robot.camera.model.height = 120;
    robot.camera.model.fx = robot.camera.model.fy = 180.0;
    robot.camera.model.cx = 80.0;
    robot.camera.model.cy = 60.0;
    return robot;
}

TEST(SimulatedVehicle, SameSeedSameBytes) {
    SimulatedDriveConfig config;
    config.speed = 1.0;
    const auto first = events_of(config, small_camera());
    const auto again = events_of(config, small_camera());
    config.seed = 2;
    const auto other = events_of(config, small_camera());
    ASSERT_EQ(first.size(), again.size());
    bool same = true;
    bool differs = first.size() != other.size();
    for (std::size_t i = 0; i < first.size(); ++i) {
        const auto bytes = [](const SensorEvent& event) {
            const auto* lidar = std::get_if<LidarBytes>(&event);
            return lidar != nullptr ? lidar->bytes : std::get<CameraFrame>(event).image;
        };
        same = same && arrival_of(first[i]) == arrival_of(again[i]) &&
               bytes(first[i]) == bytes(again[i]);
        differs = differs || bytes(first[i]) != bytes(other[i]);
    }
    EXPECT_TRUE(same);
    EXPECT_TRUE(differs);
}

TEST(SimulatedVehicle, ImagesComeAtTheirRateInOrderWithTheScans) {
    SimulatedDriveConfig config;
    config.speed = 1.0;
    const RobotConfig robot = small_camera();
    std::size_t images = 0;
    double last = 0.0;
    double last_image = 0.0;
    for (const SensorEvent& event : events_of(config, robot)) {
        EXPECT_GE(arrival_of(event), last);
        last = arrival_of(event);
        if (const auto* frame = std::get_if<CameraFrame>(&event)) {
            ++images;
            last_image = frame->arrival;
            const auto image = decode_image(frame->image, ImageColor::kBgr);
            ASSERT_TRUE(image);
            EXPECT_EQ(image->width, 160);
            EXPECT_EQ(image->height, 120);
        }
    }
    EXPECT_NEAR(static_cast<double>(images), 30.0 * last_image, 2.0);
}

double mean_level(const CameraFrame& frame) {
    const Image image = decode_image(frame.image, ImageColor::kGray).value();
    const double sum = std::accumulate(image.pixels.begin(), image.pixels.end(), 0.0);
    return sum / static_cast<double>(image.pixels.size());
}

TEST(SimulatedVehicle, FaultsOfTheCameraComeAtTheirTimesAndChangeNothingElse) {
    SimulatedDriveConfig config;
    config.speed = 1.0;
    const RobotConfig robot = small_camera();
    const auto clear = events_of(config, robot);
    config.render.covered = {1.0, 1.5};
    config.render.dimmed = {2.0, 3.0};
    const auto faulty = events_of(config, robot);
    ASSERT_EQ(faulty.size(), clear.size());
    const double late = robot.camera.latency + config.camera_jitter;
    std::size_t covered = 0;
    for (std::size_t i = 0; i < faulty.size(); ++i) {
        const double arrival = arrival_of(faulty[i]);
        ASSERT_EQ(arrival, arrival_of(clear[i]));
        const auto* frame = std::get_if<CameraFrame>(&faulty[i]);
        if (frame == nullptr) {
            EXPECT_EQ(std::get<LidarBytes>(faulty[i]).bytes, std::get<LidarBytes>(clear[i]).bytes);
            continue;
        }
        const double level = mean_level(std::get<CameraFrame>(clear[i]));
        const auto within = [&](double from, double to) {
            return arrival > from + late && arrival < to + robot.camera.latency;
        };
        if (within(1.0, 1.5)) {
            ++covered;
            EXPECT_LT(mean_level(*frame), 5.0);
        } else if (within(2.0, 3.0)) {
            EXPECT_NEAR(mean_level(*frame) / level, 0.5, 0.03);
        } else if (within(0.0, 1.0) || within(1.5, 2.0) || within(3.0, 9.0)) {
            EXPECT_EQ(frame->image, std::get<CameraFrame>(clear[i]).image) << arrival;
        }
    }
    EXPECT_NEAR(static_cast<double>(covered), 15.0, 1.0);
}

TEST(SimulatedVehicle, NearThingsAreFlaggedAsInTheProtectiveField) {
    World world = room();
    world.path = {{-1, 0}, {2.9, 0}};  // until the scanner is 0.8 m from the wall
    SimulatedDriveConfig config = clean();
    config.protective_radius = 1.0;
    const RobotConfig robot;
    SimulatedVehicle vehicle(world, "", robot, config);
    const std::vector<Scan> scans = scans_of(vehicle, robot);
    EXPECT_FALSE(scans.front().has(kProtectiveField));
    EXPECT_TRUE(scans.back().has(kProtectiveField));
}

TEST(SimulatedVehicle, DrivesAsFarAsItIsTold) {
    SimulatedDriveConfig config = clean();
    config.distance = 25.0;
    World world = room();
    world.path = {{-2, -1}, {2, -1}, {2, 1}, {-2, 1}, {-2, -1}};
    const RobotConfig robot;
    SimulatedVehicle vehicle(world, "", robot, config);
    scans_of(vehicle, robot);
    double driven = 0.0;
    const Trajectory& truth = vehicle.truth();
    for (std::size_t i = 1; i < truth.size(); ++i) {
        driven += (truth[i].pose.translation - truth[i - 1].pose.translation).norm();
    }
    EXPECT_GT(driven, 20.0) << "corners are cut";
    EXPECT_LT(driven, 26.0);
}

TEST(SimulatedVehicle, TellsWhereItReachesThroughAWall) {
    World world = room();
    const RobotConfig robot;
    EXPECT_FALSE(SimulatedVehicle(world, "", robot, clean()).first_crash());
    world.path = {{-2, 0}, {4.5, 0}};  // the scanner is 1.3 m ahead, the wall at 5 m
    const auto crash = SimulatedVehicle(world, "", robot, clean()).first_crash();
    ASSERT_TRUE(crash);
    EXPECT_NEAR(crash->pose.x(), 3.7, 0.15);
}

TEST(SimulatedVehicle, RefusesWhatCannotBeDriven) {
    const RobotConfig robot;
    SimulatedDriveConfig fast = clean();
    fast.speed = 3.0;
    EXPECT_THAT(error_of([&] { SimulatedVehicle(room(), "", robot, fast); }),
                HasSubstr("drive.speed"));
    SimulatedDriveConfig wild = clean();
    wild.dropout = 1.5;
    EXPECT_THAT(error_of([&] { SimulatedVehicle(room(), "", robot, wild); }),
                HasSubstr("drive.dropout"));
    SimulatedDriveConfig odd = clean();
    odd.camera = true;
    odd.render.covered = {2.0};
    EXPECT_THAT(error_of([&] { SimulatedVehicle(room(), "", robot, odd); }),
                HasSubstr("render.covered: must hold pairs"));
    RobotConfig bare = robot;
    bare.lidar.protocol = LidarProtocol::kThesisWords;
    EXPECT_THAT(error_of([&] { SimulatedVehicle(room(), "", bare, clean()); }),
                HasSubstr("lidar.protocol"));
    RobotConfig stub = robot;
    stub.vehicle.wheelbase = 0.0;
    EXPECT_THAT(error_of([&] { SimulatedVehicle(room(), "", stub, clean()); }),
                HasSubstr("vehicle.wheelbase"));
    EXPECT_THAT(error_of([&] { SimulatedVehicle(room(), "nowhere", robot, clean()); }),
                HasSubstr("no path 'nowhere'; there are back"));
    World still = room();
    still.path = {{1, 1}, {1, 1}};
    EXPECT_NE(error_of([&] { SimulatedVehicle(still, "", robot, clean()); }), "");
}

}  // namespace
}  // namespace hybrid_slam::test
