// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "hybrid_slam/simulator/world.hpp"

namespace hybrid_slam::test {
namespace {

constexpr double kNothing = std::numeric_limits<double>::infinity();

Eigen::Vector2d towards(double angle) {
    return {std::cos(angle), std::sin(angle)};
}

World with_wall(const Point2& start, const Point2& end) {
    World world;
    world.walls.push_back({start, end});
    return world;
}

TEST(Ray, HitsAWallInFrontAndNoneBehindOrBeside) {
    const World world = with_wall({3.0, -1.0}, {3.0, 1.0});
    EXPECT_EQ(world.cast_ray({0.0, 0.0}, {1.0, 0.0}), 3.0);
    EXPECT_EQ(world.cast_ray({0.0, 0.0}, {-1.0, 0.0}), kNothing);
    EXPECT_EQ(world.cast_ray({0.0, 2.0}, {1.0, 0.0}), kNothing);
    EXPECT_EQ(world.cast_ray({0.0, 0.0}, {0.0, 1.0}), kNothing);
    EXPECT_NEAR(world.cast_ray({0.0, 0.0}, towards(0.3)), 3.0 / std::cos(0.3), 1e-12);
}

TEST(Ray, AlongAWallItHitsTheNearerEnd) {
    const World world = with_wall({2.0, 0.0}, {5.0, 0.0});
    EXPECT_EQ(world.cast_ray({0.0, 0.0}, {1.0, 0.0}), 2.0);
    EXPECT_EQ(world.cast_ray({7.0, 0.0}, {-1.0, 0.0}), 2.0);
    EXPECT_EQ(world.cast_ray({3.0, 0.0}, {1.0, 0.0}), 0.0) << "it stands on it";
    EXPECT_EQ(world.cast_ray({7.0, 0.0}, {1.0, 0.0}), kNothing);
}

TEST(Ray, HitsAPostFromOutsideAndFromInside) {
    World world;
    world.posts.push_back({{4.0, 0.0}, 1.0});
    EXPECT_EQ(world.cast_ray({0.0, 0.0}, {1.0, 0.0}), 3.0);
    EXPECT_EQ(world.cast_ray({4.0, 0.0}, {0.0, 1.0}), 1.0);
    EXPECT_EQ(world.cast_ray({8.0, 0.0}, {1.0, 0.0}), kNothing);
    EXPECT_NEAR(world.cast_ray({0.0, 0.6}, {1.0, 0.0}), 4.0 - 0.8, 1e-12);
    EXPECT_EQ(world.cast_ray({0.0, 1.001}, {1.0, 0.0}), kNothing);
}

TEST(Ray, DoesNotSlipThroughTheCornersOfAPolygon) {
    World world;
    Points corners;
    constexpr int kCorners = 97;
    for (int i = 0; i < kCorners; ++i) {
        corners.push_back(7.3 * towards(2.0 * kPi * i / kCorners) + Point2(0.3, -0.2));
    }
    for (int i = 0; i < kCorners; ++i) {
        world.walls.push_back({corners[i], corners[(i + 1) % kCorners]});
    }
    const Point2 origin(1.1, 2.7);
    for (const Point2& corner : corners) {
        const double distance = (corner - origin).norm();
        EXPECT_NEAR(world.cast_ray(origin, (corner - origin) / distance), distance, 1e-9);
    }
}

/// The nearest of many samples along the ray that changes sides of the wall: slow and obvious.
double march(const Segment& wall, const Point2& origin, const Eigen::Vector2d& direction) {
    const Eigen::Vector2d along = wall.end - wall.start;
    const Eigen::Vector2d normal(-along.y(), along.x());
    constexpr double kStep = 1e-3;
    const auto side = [&](double t) {
        return normal.dot(origin + t * direction - wall.start) > 0.0;
    };
    for (double t = 0.0; t < 30.0; t += kStep) {
        const double share = along.dot(origin + t * direction - wall.start) / along.squaredNorm();
        if (side(t) != side(t + kStep) && share >= 0.0 && share <= 1.0) {
            return t;
        }
    }
    return kNothing;
}

TEST(Ray, AgreesWithMarchingAlongIt) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> coordinate(-8.0, 8.0);
    int hits = 0;
    for (int i = 0; i < 300; ++i) {
        const Segment wall{{coordinate(random), coordinate(random)},
                           {coordinate(random), coordinate(random)}};
        const Point2 origin(coordinate(random), coordinate(random));
        const Eigen::Vector2d direction = towards(coordinate(random));
        const double exact = with_wall(wall.start, wall.end).cast_ray(origin, direction);
        const double marched = march(wall, origin, direction);
        // A ray that passes within a step of a wall's end may go either way.
        if (std::isfinite(exact) != std::isfinite(marched)) {
            const Point2 end = origin + std::min(exact, marched) * direction;
            EXPECT_LT(std::min((end - wall.start).norm(), (end - wall.end).norm()), 0.05);
        } else if (std::isfinite(exact)) {
            EXPECT_NEAR(exact, marched, 2e-3);
            ++hits;
        }
    }
    EXPECT_GT(hits, 50);
}

}  // namespace
}  // namespace hybrid_slam::test
