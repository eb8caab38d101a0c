// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

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

TEST(ShippedWorlds, AreEleven) {
    EXPECT_EQ(shipped_worlds().size(), 11U);
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

INSTANTIATE_TEST_SUITE_P(Each, ShippedWorld, ::testing::ValuesIn(shipped_worlds()),
                         [](const auto& test) { return test.param.stem().string(); });

}  // namespace
}  // namespace hybrid_slam::test
