// SPDX-License-Identifier: Apache-2.0
#include "fan_caster.hpp"

#include <gtest/gtest.h>

#include <random>

namespace hybrid_slam::test {
namespace {

constexpr std::size_t kBeams = 541;

BeamFan s300_fan() {
    return {radians(-135.0), radians(0.5), kBeams};
}

/// A cluttered room of walls in all directions, and posts.
World random_world(std::mt19937& random) {
    std::uniform_real_distribution<double> anywhere(-8.0, 8.0);
    World world;
    const Points corners{{-9, -9}, {9, -9}, {9, 9}, {-9, 9}};
    for (std::size_t i = 0; i < 4; ++i) {
        world.walls.push_back({corners[i], corners[(i + 1) % 4]});
    }
    for (int i = 0; i < 25; ++i) {
        const Point2 start(anywhere(random), anywhere(random));
        world.walls.push_back({start, start + Point2(anywhere(random), anywhere(random)) / 6.0});
    }
    for (int i = 0; i < 6; ++i) {
        world.posts.push_back({{anywhere(random), anywhere(random)}, 0.3});
    }
    return world;
}

/// Beam by beam from where the laser is then, all shapes tried.
std::vector<double> slowly(const World& world, const MovingLaser& laser, const BeamFan& fan) {
    std::vector<double> ranges;
    for (std::size_t i = 0; i < fan.beams; ++i) {
        const double share = static_cast<double>(i) / static_cast<double>(fan.beams - 1);
        const Pose2d pose = interpolate(laser.world_from_first, laser.world_from_last, share);
        const double angle =
            pose.heading + fan.angle_min + static_cast<double>(i) * fan.angle_increment;
        ranges.push_back(world.cast_ray(pose.translation, {std::cos(angle), std::sin(angle)}));
    }
    return ranges;
}

/// A beam that grazes a corner may go either way by rounding.
std::size_t differing(const std::vector<double>& a, const std::vector<double>& b) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        count += std::abs(a[i] - b[i]) > 1e-6 ? 1 : 0;
    }
    return count;
}

TEST(FanCaster, AMovingSweepSeesWhatEachBeamSeesFromItsPlace) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> place(-7.0, 7.0);
    std::uniform_real_distribution<double> heading(-kPi, kPi);
    std::uniform_real_distribution<double> twist(-1.0, 1.0);
    std::size_t wrong = 0;
    for (int round = 0; round < 40; ++round) {
        const World world = random_world(random);
        const Pose2d first(place(random), place(random), heading(random));
        // Up to 5 cm and 2 degrees in a sweep: 1.5 m/s and 60 degrees per second.
        const Pose2d motion =
            Pose2d::exp({0.05 * twist(random), 0.02 * twist(random), radians(2.0) * twist(random)});
        const MovingLaser laser{first, first * motion};
        wrong += differing(cast_fan(world, laser, s300_fan()), slowly(world, laser, s300_fan()));
    }
    EXPECT_LE(wrong, 2U) << "of " << 40 * kBeams;
}

TEST(FanCaster, StandingStillIsTheLimitOfMoving) {
    std::mt19937 random(6);
    const World world = random_world(random);
    const Pose2d pose(0.3, 0.2, 1.0);
    EXPECT_LE(differing(cast_fan(world, pose, s300_fan()),
                        cast_fan(world, {pose, pose * Pose2d(1e-10, 0, 1e-10)}, s300_fan())),
              1U);
}

TEST(FanCaster, PeopleHideWhatIsBehindThem) {
    World world;
    world.walls.push_back({{5.0, -5.0}, {5.0, 5.0}});
    const std::vector<Circle> people{{{2.0, 0.0}, 0.25}};
    const BeamFan ahead{0.0, 0.1, 1};
    const Pose2d origin;
    EXPECT_DOUBLE_EQ(cast_fan(world, origin, ahead)[0], 5.0);
    EXPECT_DOUBLE_EQ(cast_fan(world, {origin, origin}, ahead, people)[0], 1.75);
}

TEST(Person, WalksToAndFro) {
    Person person;
    person.way = {{0, 0}, {3, 0}, {3, 4}};
    person.speed = 2.0;
    EXPECT_EQ(person.at(0.0).center, Point2(0, 0));
    EXPECT_EQ(person.at(1.0).center, Point2(2, 0));
    EXPECT_EQ(person.at(2.5).center, Point2(3, 2));
    EXPECT_EQ(person.at(3.5).center, Point2(3, 4));
    EXPECT_EQ(person.at(4.5).center, Point2(3, 2)) << "on the way back";
    EXPECT_EQ(person.at(7.0).center, Point2(0, 0));
    EXPECT_EQ(person.at(7.0 + 1.0).center, Point2(2, 0)) << "and again";
}

}  // namespace
}  // namespace hybrid_slam::test
