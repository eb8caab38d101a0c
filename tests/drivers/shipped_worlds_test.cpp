// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string>

#include "hybrid_slam/simulator/simulated_vehicle.hpp"
#include "hybrid_slam/simulator/simulator.hpp"

namespace hybrid_slam::test {
namespace {

constexpr double kMinClearance = 0.35;  ///< metres: half of a small truck

std::vector<std::filesystem::path> shipped_worlds() {
    const auto folder = std::filesystem::path(HYBRID_SLAM_SOURCE_DIR) / "config" / "worlds";
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
}

double distance_to(const Segment& wall, const Point2& point) {
    const Eigen::Vector2d along = wall.end - wall.start;
    const double share = along.dot(point - wall.start) / along.squaredNorm();
    return (wall.start + std::clamp(share, 0.0, 1.0) * along - point).norm();
}

double clearance(const World& world, const Point2& point) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Segment& wall : world.walls) {
        nearest = std::min(nearest, distance_to(wall, point));
    }
    for (const Circle& post : world.posts) {
        nearest = std::min(nearest, (point - post.center).norm() - post.radius);
    }
    return nearest;
}

TEST(ShippedWorlds, AreFourteen) {
    EXPECT_EQ(shipped_worlds().size(), 14U);
}

class ShippedWorld : public ::testing::TestWithParam<std::filesystem::path> {};

/// Every 2 cm, so that no wall of a few centimetres is stepped over.
TEST_P(ShippedWorld, PathKeepsClearOfTheWalls) {
    const World world = read_world(GetParam());
    for (std::size_t i = 0; i + 1 < world.path.size(); ++i) {
        const Eigen::Vector2d leg = world.path[i + 1] - world.path[i];
        const int steps = static_cast<int>(leg.norm() / 0.02) + 1;
        for (int step = 0; step <= steps; ++step) {
            const Point2 point = world.path[i] + leg * step / steps;
            ASSERT_GE(clearance(world, point), kMinClearance) << point.transpose();
        }
    }
}

TEST_P(ShippedWorld, IsADriveOfSomeMinutesWithLoopsThatSeesItsWalls) {
    const World world = read_world(GetParam());
    EXPECT_EQ(world.name, GetParam().stem().string());
    SimulatorConfig config;
    read_simulator_section(GetParam(), config);
    EXPECT_GE(config.speed, 0.5);
    EXPECT_LE(config.speed, 1.0);
    config.scan_rate = 1.0;
    Simulator simulator(world, config);
    while (std::optional<Measurement> measurement = simulator.next()) {
        if (const auto* scan = std::get_if<Scan>(&*measurement)) {
            const auto returns =
                std::count_if(scan->ranges.begin(), scan->ranges.end(),
                              [scan](float range) { return scan->is_return(range); });
            EXPECT_GE(returns, 20) << "at " << scan->stamp << " s";
        }
    }
    double length = 0.0;
    const Trajectory& truth = simulator.truth();
    for (std::size_t i = 0; i < truth.size(); ++i) {
        ASSERT_GE(clearance(world, truth[i].pose.translation), kMinClearance);
        length += i == 0 ? 0.0 : (truth[i].pose.translation - truth[i - 1].pose.translation).norm();
    }
    EXPECT_GE(length, 100.0);
    EXPECT_LE(length, 400.0);
    EXPECT_LT((truth.back().pose.translation - truth.front().pose.translation).norm(), 1.5)
        << "it comes back to where it began";
}

std::filesystem::path shipped(const std::string& name) {
    return std::filesystem::path(HYBRID_SLAM_SOURCE_DIR) / "config" / "worlds" / (name + ".yaml");
}

/// From the truck's rectangle to the middle of what stands there.
double gap_to(const VehicleConfig& vehicle, const Point2& in_robot) {
    const double half = 0.5 * vehicle.footprint_width;
    const double beyond_end =
        std::max({in_robot.x() - vehicle.footprint_front, -vehicle.footprint_rear - in_robot.x()});
    const double beside = std::abs(in_robot.y()) - half;
    return std::hypot(std::max(beyond_end, 0.0), std::max(beside, 0.0));
}

TEST(ThesisHallPerson, CrossesTheCamerasViewNowAndThenAndIsNeverRunOver) {
    const World world = read_world(shipped("thesis_hall_person"));
    SimulatedDriveConfig config;
    read_drive_section(shipped("thesis_hall_person"), config);
    config.camera = false;
    const RobotConfig robot;
    SimulatedVehicle vehicle(world, "figure_eight", robot, config);
    EXPECT_FALSE(vehicle.first_crash());
    while (vehicle.next()) {
    }
    constexpr double kHalfWidth = 0.4;  // tangent of half of the camera's angle of view
    int crossings = 0;
    bool was_seen = false;
    double nearest = std::numeric_limits<double>::infinity();
    for (const StampedPose& pose : vehicle.truth()) {
        const Circle person = world.people_at(pose.stamp).front();
        const Point2 in_robot = pose.pose.inverse() * person.center;
        nearest = std::min(nearest, gap_to(robot.vehicle, in_robot) - person.radius);
        const double ahead = in_robot.x() - robot.camera.mounting.x;
        const bool seen = ahead > 0.3 && std::abs(in_robot.y()) < kHalfWidth * ahead;
        crossings += seen && !was_seen ? 1 : 0;
        was_seen = seen;
    }
    EXPECT_GE(crossings, 8);
    EXPECT_GT(nearest, 0.6);
}

/// Nothing that a scan shows there tells one place from the next.
TEST(BareCorridor, BothEndsAreOutOfRangeInItsMiddle) {
    const World world = read_world(shipped("bare_corridor"));
    const RobotConfig robot;
    SimulatedDriveConfig config;
    read_drive_section(shipped("bare_corridor"), config);
    EXPECT_GE(config.distance, 42.0);
    EXPECT_LE(config.speed, 0.5);
    EXPECT_GE(config.speed, 0.3);
    for (double x = 29.1; x <= 69.1; x += 0.5) {
        const Point2 scanner(x + robot.lidar.x, 0.05);
        for (int i = 0; i < 540; ++i) {
            const double angle = radians(1.0 * i / 1.5);
            const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
            const double range = world.cast_ray(scanner, direction);
            const double across = scanner.y() + range * direction.y();
            EXPECT_TRUE(range >= robot.lidar.range_max || std::abs(std::abs(across) - 1.5) < 1e-6)
                << x << " " << angle;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Each, ShippedWorld, ::testing::ValuesIn(shipped_worlds()),
                         [](const auto& test) { return test.param.stem().string(); });

}  // namespace
}  // namespace hybrid_slam::test
