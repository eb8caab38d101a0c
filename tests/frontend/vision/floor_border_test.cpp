// SPDX-License-Identifier: Apache-2.0
#include "floor_border.hpp"

#include <gtest/gtest.h>

#include "support/room.hpp"

namespace hybrid_slam::test {
namespace {

/// Of a scanner in the middle of a round room.
Scan round_room(double radius) {
    Scan scan;
    scan.angle_min = -kPi;
    scan.angle_increment = radians(0.5);
    scan.range_min = 0.02;
    scan.range_max = 30.0;
    scan.ranges.assign(720, static_cast<float>(radius));
    return scan;
}

/// The forklift's scanner before a wall across its way.
Scan wall_ahead(double distance, const Pose2d& robot_from_laser = {}) {
    World world;
    world.walls.push_back({{distance, -100.0}, {distance, 100.0}});
    Lidar lidar;
    lidar.beams = 541;
    lidar.field_of_view = radians(270.5);
    lidar.robot_from_laser = robot_from_laser;
    return scan_at(world, {}, lidar);
}

Eigen::Vector3d towards(double angle, double slope = -0.2) {
    return {std::cos(angle), std::sin(angle), slope};
}

double distance(const FloorBorder& border, double angle) {
    return border.distance(towards(angle)).value_or(-1.0);
}

TEST(FloorBorder, IsTheWallAroundTheScanner) {
    const FloorBorder border(round_room(3.0), {}, {0.0, 0.0});
    for (double angle = -3.1; angle < 3.1; angle += 0.01) {
        ASSERT_NEAR(distance(border, angle), 3.0, 1e-3) << angle;
    }
}

TEST(FloorBorder, IsMeasuredFromTheCamera) {
    const Eigen::Vector2d camera(1.0, 0.4);
    const FloorBorder border(round_room(3.0), {}, camera);
    for (double angle = -3.1; angle < 3.1; angle += 0.01) {
        // |camera + s u| = 3
        const Eigen::Vector2d u(std::cos(angle), std::sin(angle));
        const double along = camera.dot(u);
        const double truth = -along + std::sqrt(along * along + 9.0 - camera.squaredNorm());
        ASSERT_NEAR(distance(border, angle), truth, 0.02) << angle;
    }
}

TEST(FloorBorder, HeightOfTheDirectionDoesNotMatter) {
    const FloorBorder border(wall_ahead(4.0), {}, {1.2, 0.0});
    for (const double slope : {-2.0, 0.0, 0.7}) {
        EXPECT_NEAR(border.distance(towards(0.0, slope)).value(), 2.8, 1e-3);
        EXPECT_NEAR(border.distance(5.0 * towards(0.0, slope)).value(), 2.8, 1e-3);
    }
}

TEST(FloorBorder, AWallAheadIsFartherToTheSides) {
    const FloorBorder border(wall_ahead(4.0, {0.5, 0.3, 0.2}), {}, {1.2, 0.0});
    for (const double angle : {-0.6, -0.2, 0.1, 0.5}) {
        EXPECT_NEAR(distance(border, angle), 2.8 / std::cos(angle), 0.03) << angle;
    }
}

// A column without a border would take the wall in it for floor.
TEST(FloorBorder, HasNoGapsWhereTheScanHasNone) {
    for (const double wall : {1.8, 2.2, 4.0, 12.0}) {
        const FloorBorder border(wall_ahead(wall), {}, {1.2, 0.0});
        for (double angle = -0.45; angle < 0.45; angle += 0.004) {
            ASSERT_NEAR(distance(border, angle), (wall - 1.2) / std::cos(angle), 0.1)
                << wall << " m, " << degrees(angle) << " degrees";
        }
    }
}

TEST(FloorBorder, SaysNothingWhereTheScanSawNothing) {
    Scan scan = round_room(3.0);
    for (std::size_t i = 350; i < 380; ++i) {
        scan.ranges[i] = i % 2 == 0 ? 30.0F : 0.0F;  // about ahead
    }
    const FloorBorder border(scan, {}, {0.0, 0.0});
    EXPECT_FALSE(border.distance(towards(0.02)).has_value());
    EXPECT_TRUE(border.distance(towards(0.5)).has_value());
    const FloorBorder blind(blind_scan(), {}, {0.0, 0.0});
    EXPECT_FALSE(blind.distance(towards(1.0)).has_value());
    const FloorBorder empty(Scan(), {}, {0.0, 0.0});
    EXPECT_FALSE(empty.distance(towards(1.0)).has_value());
}

TEST(FloorBorder, SaysNothingBehindAScannerThatLooksAhead) {
    Scan scan = round_room(3.0);
    scan.ranges.resize(361);
    scan.angle_min = -0.5 * kPi;
    const FloorBorder border(scan, {}, {0.0, 0.0});
    EXPECT_NEAR(distance(border, 1.5), 3.0, 1e-4);
    EXPECT_FALSE(border.distance(towards(1.7)).has_value());
    EXPECT_FALSE(border.distance(towards(kPi)).has_value());
}

TEST(FloorBorder, ComesNearerWhileTheRobotDrivesOnSinceTheScan) {
    const Pose2d scan_from_image(0.5, 0.0, 0.1);
    const FloorBorder border(wall_ahead(4.0), scan_from_image.inverse(), {1.2, 0.0});
    // The camera is now at 0.5 + 1.2 cos 0.1 along the way and looks 0.1 to the left.
    EXPECT_NEAR(distance(border, -0.1), 3.5 - 1.2 * std::cos(0.1), 0.01);
    EXPECT_NEAR(distance(border, 0.2), (3.5 - 1.2 * std::cos(0.1)) / std::cos(0.3), 0.03);
}

TEST(FloorBorder, TheNearestThingInADirectionCounts) {
    World world = irregular_room();
    world.posts.push_back({{1.5, 0.0}, 0.1});
    Lidar lidar;
    lidar.beams = 720;
    const FloorBorder border(scan_at(world, {}, lidar), {}, {0.0, 0.5});
    EXPECT_NEAR(distance(border, std::atan2(-0.5, 1.5)), std::hypot(1.5, 0.5) - 0.1, 0.03);
}

}  // namespace
}  // namespace hybrid_slam::test
