// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vehicle/surroundings.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "halls.hpp"

namespace hybrid_slam {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();

/// 270 degrees of view from 1.3 m ahead of the robot's origin, nothing there.
Scan empty_scan(double stamp) {
    Scan scan;
    scan.stamp = stamp;
    scan.angle_min = -radians(135.0);
    scan.angle_increment = radians(0.5);
    scan.range_min = 0.05;
    scan.range_max = 29.5;
    scan.robot_from_laser = {1.3, 0.0, 0.0};
    scan.ranges.assign(541, kNothing);
    return scan;
}

/// Five beams that end around a place in the robot's frame.
void put(Scan& scan, const Point2& in_robot) {
    const Point2 seen = scan.robot_from_laser.inverse() * in_robot;
    const double beam = (std::atan2(seen.y(), seen.x()) - scan.angle_min) / scan.angle_increment;
    for (int i = -2; i <= 2; ++i) {
        scan.ranges.at(static_cast<std::size_t>(std::lround(beam) + i)) =
            static_cast<float>(seen.norm());
    }
}

bool has(const Points& points, const Point2& place, double within = 0.1) {
    return std::any_of(points.begin(), points.end(),
                       [&](const Point2& point) { return (point - place).norm() < within; });
}

TEST(Surroundings, AreWhatTheScanSees) {
    Surroundings around({});
    Scan scan = empty_scan(0.0);
    put(scan, {3.0, 0.5});
    put(scan, {9.0, 0.0});
    around.see(scan, {});
    EXPECT_TRUE(has(around.obstacles(), {3.0, 0.5}, 0.05));
    EXPECT_FALSE(has(around.obstacles(), {9.0, 0.0})) << "farther than one looks";
}

TEST(Surroundings, RememberWhatWentOutOfSight) {
    SurroundingsConfig config;
    config.remember = 5.0;
    Surroundings around(config);
    Scan scan = empty_scan(0.0);
    put(scan, {2.5, 0.8});
    around.see(scan, {});
    // Three metres on it is behind the scanner, where that does not look.
    around.see(empty_scan(4.0), {3.0, 0.0, 0.0});
    EXPECT_TRUE(has(around.obstacles(), {-0.5, 0.8}));
    around.see(empty_scan(6.0), {3.2, 0.0, 0.0});
    EXPECT_TRUE(around.obstacles().empty()) << "too long ago";
}

TEST(Surroundings, ForgetWhatIsSeenToBeGone) {
    Surroundings around({});
    Scan scan = empty_scan(0.0);
    put(scan, {2.5, 0.8});
    around.see(scan, {});
    around.see(empty_scan(0.1), {});
    EXPECT_TRUE(around.obstacles().empty());
    // A blind sector does not see that, and no more does a beam that ends before.
    around.see(scan, {});
    Scan blind = empty_scan(0.2);
    blind.ranges.assign(blind.ranges.size(), std::numeric_limits<float>::quiet_NaN());
    around.see(blind, {});
    EXPECT_TRUE(has(around.obstacles(), {2.5, 0.8}));
    Scan hidden = empty_scan(0.3);
    hidden.ranges.assign(hidden.ranges.size(), 0.5F);
    around.see(hidden, {});
    EXPECT_TRUE(has(around.obstacles(), {2.5, 0.8}));
}

TEST(Surroundings, KnowWhetherTheyAreSeenBehind) {
    Surroundings around({});
    EXPECT_FALSE(around.sees_behind({}));
    around.see(empty_scan(0.0), {});
    EXPECT_FALSE(around.sees_behind({})) << "270 degrees from ahead";
    Scan scan = empty_scan(1.0);
    scan.robot_from_laser = {-1.1, 0.0, kPi};
    around.see(scan, {});
    EXPECT_TRUE(around.sees_behind({}));
}

TEST(Surroundings, MoveWithACorrectionOfThePose) {
    Surroundings around({});
    Scan scan = empty_scan(0.0);
    put(scan, {2.5, 0.8});
    around.see(scan, {});
    const Pose2d correction(10.0, -3.0, 1.0);
    around.correct(correction);
    around.see(empty_scan(1.0), correction * Pose2d(3.0, 0.0, 0.0));
    EXPECT_TRUE(has(around.obstacles(), {-0.5, 0.8}));
}

TEST(Surroundings, KeepNegativePlacesApart) {
    for (const Point2& place : {Point2(2.5, 0.8), Point2(2.5, -0.8), Point2(1.7, 1.9)}) {
        const Pose2d start(-7.0, -4.0, 2.0);
        Scan scan = empty_scan(0.0);
        put(scan, place);
        Surroundings around({});
        around.see(scan, start);
        around.see(empty_scan(1.0), start * Pose2d(3.0, 0.0, 0.0));
        EXPECT_TRUE(has(around.obstacles(), place - Point2(3.0, 0.0)));
        EXPECT_LE(around.obstacles().size(), 5U);
    }
}

TEST(Surroundings, TakeTheMapWhereTheScanDoesNotLook) {
    StateGrid map = test::room(10.0, 8.0);
    Surroundings around({});
    const Pose2d pose(-3.0, 0.0, 0.0);  // the wall behind is 2 m away
    around.see(empty_scan(0.0), pose);
    EXPECT_TRUE(has(around.obstacles(map), {-2.0, 0.0}));
    EXPECT_FALSE(has(around.obstacles(map), {0.0, 4.0})) << "a wall that the scan looks through";
    // The same with a grid that lies turned in the map.
    const Pose2d corner(map.geometry.origin, 0.0);
    map.origin_yaw = 0.5;
    const Pose2d turn = Pose2d(map.geometry.origin, 0.5) * corner.inverse();
    around.see(empty_scan(0.0), turn * pose);
    EXPECT_TRUE(has(around.obstacles(map), {-2.0, 0.0}));
    EXPECT_FALSE(has(around.obstacles(map), {0.0, 4.0}));
}

}  // namespace
}  // namespace hybrid_slam
