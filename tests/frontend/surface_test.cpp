// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/registration/surface.hpp"

#include <gtest/gtest.h>

#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"
#include "support/room.hpp"

namespace hybrid_slam::test {
namespace {

Points straight_wall(const Point2& start, const Point2& end, int count) {
    Points points;
    for (int i = 0; i < count; ++i) {
        points.push_back(start + (end - start) * i / (count - 1));
    }
    return points;
}

double angle_between(const Point2& a, const Point2& b) {
    return std::acos(std::clamp(a.dot(b), -1.0, 1.0));
}

TEST(WithNormals, AreExactOnAStraightWallAndFaceTheViewpoint) {
    NormalConfig config;
    config.radius = 0.15;
    for (const double heading : {0.0, 0.3, 1.5707, 2.5, 3.1, -1.2}) {
        // Far from the origin, where sums of squares lose their digits.
        const Pose2d place(1e4, -2e4, heading);
        const Points points = transform(place, straight_wall({-1.0, 0.0}, {1.0, 0.0}, 41));
        for (const double side : {-1.0, 1.0}) {
            const Surface surface = with_normals(points, place * Point2(0.3, 2.0 * side), config);
            ASSERT_EQ(surface.points, points);
            ASSERT_EQ(surface.normals.size(), points.size());
            const Point2 expected = place.rotation() * Point2(0.0, side);
            for (const Point2& normal : surface.normals) {
                ASSERT_NEAR(normal.norm(), 1.0, 1e-9);
                ASSERT_LT(angle_between(normal, expected), 1e-6);
            }
        }
    }
}

TEST(WithNormals, AverageNoiseOut) {
    Rng rng(3);
    NormalConfig config;
    config.radius = 0.5;
    Points points = straight_wall({-2.0, 1.0}, {2.0, 1.0}, 401);
    for (Point2& point : points) {
        point.y() += gauss(rng, 0.01);
    }
    const Surface surface = with_normals(points, {0.0, 0.0}, config);
    double squares = 0.0;
    for (const Point2& normal : surface.normals) {
        ASSERT_GT(normal.norm(), 0.5);
        squares += std::pow(angle_between(normal, {0.0, -1.0}), 2);
    }
    // A line through n points spread evenly over length l: sigma of its slope is sigma sqrt(12 / n)
    // / l.
    const double expected = 0.01 * std::sqrt(12.0 / 101.0) / 1.0;
    EXPECT_LT(std::sqrt(squares / 401.0), 2.0 * expected);
}

TEST(WithNormals, ChangeOverAtACornerAndNowhereElse) {
    NormalConfig config;
    config.radius = 0.2;
    config.radius_per_metre = 0.0;
    Points points = straight_wall({0.0, 2.0}, {1.0, 2.0}, 51);
    const Points other = straight_wall({1.0, 1.98}, {1.0, 1.0}, 50);
    points.insert(points.end(), other.begin(), other.end());
    const Surface surface = with_normals(points, {0.0, 0.0}, config);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Point2& normal = surface.normals[i];
        const double to_corner = (points[i] - Point2(1.0, 2.0)).norm();
        if (to_corner > 0.2 + 1e-9) {
            const Point2 expected = i < 51 ? Point2(0.0, -1.0) : Point2(-1.0, 0.0);
            EXPECT_LT(angle_between(normal, expected), 1e-6) << points[i].transpose();
        } else if (to_corner < 0.03) {
            // Half of the neighbours lie on either wall: across both, or nothing.
            EXPECT_TRUE(normal.isZero(0.0) ||
                        angle_between(normal, Point2(-1.0, -1.0).normalized()) < 0.3);
        }
    }
}

TEST(WithNormals, AThinPostHasNoneAndAThickPillarItsRadii) {
    NormalConfig config;
    config.radius = 0.15;
    config.radius_per_metre = 0.0;
    config.max_spread = 0.35;
    World world;
    world.posts.push_back({{2.0, 0.0}, 0.05});
    Lidar fine;
    fine.beams = 1440;
    const Scan thin = scan_at(world, {}, fine);
    Points hits = surface_of(thin).points;
    ASSERT_GT(hits.size(), 8U);
    // Seen from within its own ring the whole post would be a circle; from outside it is half of
    // one.
    hits.emplace_back(2.05, 0.0);
    hits.insert(hits.begin(), Point2(2.05, 0.0));
    const Surface post = with_normals(hits, {0.0, 0.0}, config);
    EXPECT_EQ(oriented(post).size(), 0U);

    world.posts[0].radius = 1.0;
    const Surface pillar = surface_of(scan_at(world, {}, fine));
    ASSERT_GT(pillar.size(), 200U);
    for (std::size_t i = 40; i + 40 < pillar.size(); ++i) {
        const Point2 radial = (pillar.points[i] - Point2(2.0, 0.0)).normalized();
        EXPECT_LT(angle_between(pillar.normals[i], radial), 0.05);
    }
}

TEST(WithNormals, LonePointsAndPairsHaveNone) {
    NormalConfig config;
    config.radius = 0.1;
    config.radius_per_metre = 0.0;
    const Surface lone = with_normals({{1, 0}, {2, 0}, {2.05, 0}, {5, 5}}, {0.0, 0.0}, config);
    ASSERT_EQ(lone.size(), 4U);
    EXPECT_EQ(oriented(lone).size(), 0U);
    EXPECT_EQ(with_normals({}, {0.0, 0.0}, config).size(), 0U);
    EXPECT_EQ(oriented(with_normals(Points(5, Point2(1.0, 1.0)), {0, 0}, config)).size(), 0U);
}

TEST(WithNormals, DoNotReachAcrossAJumpInRange) {
    // Two parallel walls, one shadowing the other: their points follow each other in the scan.
    Points points = straight_wall({-1.0, 2.0}, {0.0, 2.0}, 21);
    const Points behind = straight_wall({0.0, 3.0}, {1.0, 3.0}, 21);
    points.insert(points.end(), behind.begin(), behind.end());
    NormalConfig config;
    config.radius = 0.3;
    for (const Point2& normal : with_normals(points, {0.0, 0.0}, config).normals) {
        EXPECT_LT(angle_between(normal, {0.0, -1.0}), 1e-6);
    }
}

TEST(WithNormals, SupportGrowsWithTheRange) {
    // 20 m away beams one degree apart are 35 cm apart.
    World world;
    world.walls.push_back({{20.0, -5.0}, {20.0, 5.0}});
    const Points points = surface_of(scan_at(world, {})).points;
    NormalConfig config;
    config.radius = 0.15;
    config.radius_per_metre = 0.0;
    EXPECT_EQ(oriented(with_normals(points, {0.0, 0.0}, config)).size(), 0U);
    config.radius_per_metre = 0.04;
    EXPECT_EQ(oriented(with_normals(points, {0.0, 0.0}, config)).size(), points.size());
}

TEST(Surface, OrientedKeepsThePointsWithANormalInOrder) {
    const Surface surface{{{1, 0}, {2, 0}, {3, 0}}, {{0, 1}, {0, 0}, {1, 0}}};
    const Surface kept = oriented(surface);
    EXPECT_EQ(kept.points, (Points{{1, 0}, {3, 0}}));
    EXPECT_EQ(kept.normals, (Points{{0, 1}, {1, 0}}));
}

TEST(Surface, TransformMovesPointsAndOnlyTurnsNormals) {
    const Surface surface{{{1, 0}, {2, 5}}, {{0, 1}, {0, 0}}};
    const Surface moved = transform(Pose2d(10.0, 20.0, kPi / 2.0), surface);
    EXPECT_LT((moved.points[0] - Point2(10.0, 21.0)).norm(), 1e-12);
    EXPECT_LT((moved.points[1] - Point2(5.0, 22.0)).norm(), 1e-12);
    EXPECT_LT((moved.normals[0] - Point2(-1.0, 0.0)).norm(), 1e-12);
    EXPECT_TRUE(moved.normals[1].isZero(0.0)) << "unknown stays unknown";
}

TEST(Surface, AppendKeepsBoth) {
    Surface surface{{{1, 0}}, {{0, 1}}};
    surface.append({{{2, 0}}, {{1, 0}}});
    EXPECT_EQ(surface.points, (Points{{1, 0}, {2, 0}}));
    EXPECT_EQ(surface.normals, (Points{{0, 1}, {1, 0}}));
}

TEST(Reference, RefusesAnEmptySurface) {
    EXPECT_NE(error_of([] { Reference{Surface{}}; }), "");
}

}  // namespace
}  // namespace hybrid_slam::test
