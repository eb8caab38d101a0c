// SPDX-License-Identifier: Apache-2.0
#include "footprint.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace hybrid_slam::test {
namespace {

using Rng = std::mt19937;

double draw(Rng& rng, double most) {
    return std::uniform_real_distribution<double>(-most, most)(rng);
}

VehicleConfig forklift() {
    VehicleConfig vehicle;
    vehicle.footprint_front = 1.5;
    vehicle.footprint_rear = 1.1;
    vehicle.footprint_width = 0.9;
    return vehicle;
}

/// Metres from a point to the rectangle, negative inside.
double distance_to(const Footprint& footprint, const Point2& point) {
    const Eigen::Vector2d beyond = (footprint.least - point).cwiseMax(point - footprint.most);
    return beyond.maxCoeff() <= 0.0 ? beyond.maxCoeff() : beyond.cwiseMax(0.0).norm();
}

/// The nearest that a wall comes, by trying many of its points.
double nearest_of(const Footprint& footprint, const Segment& wall) {
    constexpr int kTries = 2000;
    double nearest = 1e9;
    for (int i = 0; i <= kTries; ++i) {
        const Point2 point = wall.start + (wall.end - wall.start) * i / kTries;
        nearest = std::min(nearest, distance_to(footprint, point));
    }
    return nearest;
}

TEST(Footprint, MeetsWallsAsTryingTheirPointsSays) {
    Rng rng(3);
    const Footprint footprint(forklift());
    int met = 0;
    int close = 0;
    for (int i = 0; i < 3000; ++i) {
        const Segment wall{{draw(rng, 3.0), draw(rng, 2.0)}, {draw(rng, 3.0), draw(rng, 2.0)}};
        const double nearest = nearest_of(footprint, wall);
        if (std::abs(nearest) < 2e-3) {
            ++close;  // between two of the points that were tried
            continue;
        }
        const auto at = footprint.meets(wall);
        ASSERT_EQ(at.has_value(), nearest < 0.0) << i;
        if (at) {
            ++met;
            EXPECT_LE(distance_to(footprint, *at), 1e-9) << i;
        }
    }
    EXPECT_GT(met, 500);
    EXPECT_LT(close, 100);
}

TEST(Footprint, MeetsPostsAsTheirDistanceSays) {
    Rng rng(4);
    const Footprint footprint(forklift());
    int met = 0;
    for (int i = 0; i < 3000; ++i) {
        const Circle post{{draw(rng, 3.0), draw(rng, 2.0)}, 0.01 + std::abs(draw(rng, 0.5))};
        const bool expected = distance_to(footprint, post.center) <= post.radius;
        EXPECT_EQ(footprint.meets(post).has_value(), expected) << i;
        met += expected ? 1 : 0;
    }
    EXPECT_GT(met, 500);
    EXPECT_LT(met, 2500);
}

TEST(Footprint, WallsAlongAxesCornersAndPoints) {
    const Footprint footprint(forklift());
    EXPECT_TRUE(footprint.meets(Segment{{1.5, -5.0}, {1.5, 5.0}})) << "touching counts";
    EXPECT_FALSE(footprint.meets(Segment{{1.5001, -5.0}, {1.5001, 5.0}}));
    EXPECT_TRUE(footprint.meets(Segment{{-5.0, 0.45}, {5.0, 0.45}}));
    EXPECT_FALSE(footprint.meets(Segment{{-5.0, 0.4501}, {5.0, 0.4501}}));
    EXPECT_TRUE(footprint.meets(Segment{{0.0, 0.0}, {0.0, 0.0}})) << "a point inside";
    EXPECT_FALSE(footprint.meets(Segment{{2.0, 0.0}, {2.0, 0.0}}));
    EXPECT_TRUE(footprint.meets(Segment{{0.2, 0.1}, {0.4, -0.1}})) << "wholly inside";
    // Past the corner (1.5, 0.45) at a slope of -1.
    EXPECT_FALSE(footprint.meets(Segment{{1.0, 0.96}, {2.0, -0.04}}));
    EXPECT_TRUE(footprint.meets(Segment{{1.0, 0.94}, {2.0, -0.06}}));
}

TEST(Footprint, TouchedNamesWhatAndWhereInTheWorld) {
    World world;
    world.walls = {{{-9, -9}, {9, -9}}, {{4, -9}, {4, 9}}};
    world.posts = {{{-5, 0}, 0.2}};
    const Footprint footprint(forklift());
    const auto touched_at = [&](const Pose2d& pose, const std::vector<Circle>& people) {
        const auto obstacle = touched(world, people, footprint, pose);
        return obstacle ? obstacle->name : std::string();
    };
    EXPECT_EQ(touched_at({0, 0, 0}, {}), "");
    EXPECT_EQ(touched_at({2.6, 0, 0}, {}), "wall 1");
    EXPECT_EQ(touched_at({2.6, 0, kPi}, {}), "") << "the rear is shorter";
    EXPECT_EQ(touched_at({2.6, 0, kPi / 2}, {}), "");
    EXPECT_EQ(touched_at({0, -7.6, -kPi / 2}, {}), "wall 0");
    EXPECT_EQ(touched_at({-3.8, 0, 0}, {}), "post 0");
    EXPECT_EQ(touched_at({0, 0, 0}, {{{5, 5}, 0.2}, {{0, 0.6}, 0.2}}), "person 1");
    const auto wall = touched(world, {}, footprint, {2.6, 0, 0});
    ASSERT_TRUE(wall);
    EXPECT_NEAR(wall->at.x(), 4.0, 1e-9);
    EXPECT_LE(std::abs(wall->at.y()), 0.45);
}

}  // namespace
}  // namespace hybrid_slam::test
