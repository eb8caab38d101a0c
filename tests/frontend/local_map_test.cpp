// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/odometry/local_map.hpp"

#include <gtest/gtest.h>

#include "support/room.hpp"

namespace hybrid_slam::test {
namespace {

Surface one(const Point2& point, const Point2& normal) {
    return {{point}, {normal}};
}

TEST(Merge, AveragesWhatLiesInOneCellAndFacesOneSide) {
    const Surface merged =
        merge({one({0.01, 0.02}, {1.0, 0.0}), one({0.03, 0.04}, {std::cos(0.2), std::sin(0.2)}),
               one({0.05, 0.03}, {std::cos(-0.2), std::sin(-0.2)})},
              0.1);
    ASSERT_EQ(merged.size(), 1U);
    EXPECT_LT((merged.points[0] - Point2(0.03, 0.03)).norm(), 1e-12);
    EXPECT_LT((merged.normals[0] - Point2(1.0, 0.0)).norm(), 1e-12);
}

TEST(Merge, KeepsCellsApart) {
    const Surface merged = merge({one({0.09, 0.0}, {1, 0}), one({0.11, 0.0}, {1, 0}),
                                  one({-0.01, 0.0}, {1, 0}), one({0.09, -0.01}, {1, 0})},
                                 0.1);
    EXPECT_EQ(merged.size(), 4U);
}

TEST(Merge, KeepsTheFacesOfAThinWallApartWhateverItsDirection) {
    for (int step = 0; step < 64; ++step) {
        const double angle = 2.0 * kPi * step / 64;
        const Point2 normal(std::cos(angle), std::sin(angle));
        const Point2 middle(0.55, 0.55);
        const Surface merged =
            merge({one(middle + 0.01 * normal, normal), one(middle - 0.01 * normal, -normal)}, 0.1);
        ASSERT_EQ(merged.size(), 2U) << "wall facing " << degrees(angle) << " deg";
        EXPECT_GT(merged.normals[0].dot(normal), 0.99);
        EXPECT_GT(merged.normals[1].dot(-normal), 0.99);
    }
}

TEST(Merge, DoesNotLetPointsWithoutANormalBlurThoseWithOne) {
    const Surface merged = merge({one({0.02, 0.02}, {0, 1}), one({0.08, 0.08}, {0, 0})}, 0.1);
    ASSERT_EQ(merged.size(), 2U);
    EXPECT_EQ(merged.points[0], Point2(0.02, 0.02));
    EXPECT_TRUE(merged.normals[1].isZero(0.0));
}

TEST(Merge, TellsCellsApartFarFromTheOriginOnBothSidesOfIt) {
    std::deque<Surface> surfaces;
    for (const double x : {-2000.0, -0.5, 0.5, 2000.0}) {
        for (const double y : {-2000.0, -0.5, 0.5, 2000.0}) {
            surfaces.push_back(one({x, y}, {1, 0}));
        }
    }
    EXPECT_EQ(merge(surfaces, 0.05).size(), 16U);
}

TEST(Merge, KeepsTheOrderOfFirstAppearance) {
    Rng rng(5);
    Surface surface;
    Points firsts;
    for (int i = 0; i < 500; ++i) {
        const Point2 cell(std::floor(uniform(rng, -20, 20)), std::floor(uniform(rng, -20, 20)));
        const Point2 point = cell + Point2(0.5, 0.5);
        if (std::find(firsts.begin(), firsts.end(), point) == firsts.end()) {
            firsts.push_back(point);
        }
        surface.append(one(point, {0, 1}));
    }
    EXPECT_EQ(merge({surface}, 1.0).points, firsts);
}

TEST(Merge, LosesNoMass) {
    // Sums are kept: averages times counts add up to the points that came in.
    const Surface scan = surface_of(scan_at(irregular_room(), {}));
    const Surface merged = merge({scan}, 1e-4);
    ASSERT_EQ(merged.size(), scan.size()) << "cells smaller than any spacing";
    const Surface coarse = merge({scan, scan, scan}, 0.2);
    EXPECT_LT(coarse.size(), scan.size());
    const World world = irregular_room();
    for (const Point2& point : coarse.points) {
        EXPECT_LT(distance_to(world, point), 0.1);
    }
    EXPECT_EQ(merge({}, 0.1).size(), 0U);
}

TEST(LocalMap, IsEmptyBeforeAnyPoint) {
    LocalMap map({3, 0.05});
    EXPECT_FALSE(map.reference());
    map.insert({});
    EXPECT_FALSE(map.reference());
    map.insert(one({1, 2}, {0, 1}));
    ASSERT_TRUE(map.reference());
    EXPECT_EQ(map.reference()->surface().points, (Points{{1, 2}}));
}

TEST(LocalMap, ForgetsTheOldestBeyondItsSize) {
    LocalMap map({3, 0.05});
    for (int i = 0; i < 6; ++i) {
        map.insert(one({1.0 * i, 0.0}, {0, 1}));
    }
    EXPECT_EQ(map.reference()->surface().points, (Points{{3, 0}, {4, 0}, {5, 0}}));
}

TEST(LocalMap, OfOneScanIsThatScanUntouched) {
    const Surface scan = surface_of(scan_at(irregular_room(), {}));
    LocalMap map({1, 1.0});
    map.insert(one({9, 9}, {1, 0}));
    map.insert(scan);
    EXPECT_EQ(map.reference()->surface().points, scan.points);
}

}  // namespace
}  // namespace hybrid_slam::test
