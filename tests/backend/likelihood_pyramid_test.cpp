// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/likelihood_pyramid.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hybrid_slam/backend/correlative_matcher.hpp"
#include "support/error_of.hpp"
#include "support/room.hpp"

namespace hybrid_slam::test {
namespace {

constexpr double kResolution = 0.1;

TEST(LikelihoodPyramid, BlursEachPointAndKeepsTheLargerValue) {
    const double sigma = 0.15;
    const Points points{{0.05, 0.05}, {0.45, 0.05}};
    const LikelihoodPyramid pyramid(points, kResolution, sigma, 1);
    const GridGeometry& geometry = pyramid.geometry();
    for (double x = -1.0; x < 1.5; x += kResolution) {
        for (double y = -1.0; y < 1.0; y += kResolution) {
            const Point2 center(std::floor(x / kResolution) * kResolution + 0.05,
                                std::floor(y / kResolution) * kResolution + 0.05);
            double expected = 0.0;
            for (const Point2& point : points) {
                const double squared = (center - point).squaredNorm();
                expected = std::max(expected, 255.0 * std::exp(-0.5 * squared / (sigma * sigma)));
            }
            const Cell cell = geometry.cell_of(center);
            const double found = pyramid.at(0, cell.x, cell.y);
            // The stamp ends at some 2.5 sigma, where 4 % are left of the peak.
            ASSERT_NEAR(found, expected, expected < 0.05 * 255.0 ? 0.05 * 255.0 : 0.51)
                << center.transpose();
        }
    }
}

TEST(LikelihoodPyramid, EachLevelIsTheMaximumOverItsBlocks) {
    Rng rng(53);
    Points points;
    for (int i = 0; i < 30; ++i) {
        const double x = uniform(rng, -1.5, 1.5);
        points.emplace_back(x, uniform(rng, -1.0, 1.0));
    }
    const LikelihoodPyramid pyramid(points, kResolution, 0.1, 4);
    const GridGeometry& geometry = pyramid.geometry();
    for (int level = 1; level < 4; ++level) {
        const int side = 1 << level;
        // Blocks that hang over the edge, to all sides, too.
        for (int y = -side - 1; y <= geometry.height + 1; ++y) {
            for (int x = -side - 1; x <= geometry.width + 1; ++x) {
                std::uint8_t expected = 0;
                for (int dy = 0; dy < side; ++dy) {
                    for (int dx = 0; dx < side; ++dx) {
                        expected = std::max(expected, pyramid.at(0, x + dx, y + dy));
                    }
                }
                ASSERT_EQ(pyramid.at(level, x, y), expected) << level << " " << x << " " << y;
            }
        }
    }
}

TEST(LikelihoodPyramid, IsZeroOutside) {
    const LikelihoodPyramid pyramid({{0, 0}}, kResolution, 0.1, 2);
    const GridGeometry& geometry = pyramid.geometry();
    EXPECT_EQ(pyramid.at(0, -1, 0), 0);
    EXPECT_EQ(pyramid.at(1, 0, -1), 0);
    EXPECT_EQ(pyramid.at(0, geometry.width, 0), 0);
    EXPECT_EQ(pyramid.at(1, 0, geometry.height), 0);
    EXPECT_EQ(match_score(pyramid, {{1e6, 1e6}}, {}), 0.0);
    EXPECT_EQ(match_score(pyramid, {{0, 0}}, {}), 1.0);
}

TEST(LikelihoodPyramid, RefusesMisuse) {
    EXPECT_NE(error_of([] { LikelihoodPyramid({}, 0.1, 0.1, 3); }), "");
    EXPECT_NE(error_of([] { LikelihoodPyramid({{0, 0}}, 0.1, 0.1, 0); }), "");
    EXPECT_NE(error_of([] { LikelihoodPyramid({{0, 0}, {1e7, 1e7}}, 0.1, 0.1, 3); }), "");
}

/// Level by level, by looking at all cells of each block.
void expect_bounds(const LikelihoodPyramid& pyramid) {
    const GridGeometry& geometry = pyramid.geometry();
    for (int level = 1; level < pyramid.levels(); ++level) {
        const int half = 1 << (level - 1);
        for (int y = -2 * half; y < geometry.height; ++y) {
            for (int x = -2 * half; x < geometry.width; ++x) {
                const std::uint8_t parts =
                    std::max({pyramid.at(level - 1, x, y), pyramid.at(level - 1, x + half, y),
                              pyramid.at(level - 1, x, y + half),
                              pyramid.at(level - 1, x + half, y + half)});
                ASSERT_GE(pyramid.at(level, x, y), parts) << level << ": " << x << ", " << y;
            }
        }
    }
}

TEST(LikelihoodPyramid, ABlockIsNeverLessLikelyThanItsParts) {
    Rng rng(7);
    for (const double size : {0.0, 1.0, 9.0, 60.0}) {
        Points walls;
        for (int i = 0; i < 40; ++i) {
            const double x = uniform(rng, -size, 0.3 * size);
            walls.emplace_back(x, uniform(rng, 5.0, 5.0 + size));
        }
        expect_bounds(search_pyramid(walls));
    }
}

TEST(LikelihoodPyramid, IsTakenOnlyWithTheRimThatItsLevelsNeed) {
    GridGeometry geometry;
    geometry.width = 9;
    geometry.height = 7;
    const auto with = [&](int x, int y, int levels) {
        std::vector<std::uint8_t> finest(63, 0);
        finest[geometry.index_of({x, y})] = 1;
        return LikelihoodPyramid(geometry, finest, levels);
    };
    for (int y = 0; y < geometry.height; ++y) {
        for (int x = 0; x < geometry.width; ++x) {
            for (const int levels : {1, 2, 3}) {
                const int rim = (1 << (levels - 1)) - 1;
                if (x < rim || y < rim) {
                    EXPECT_THAT(error_of([&] { with(x, y, levels); }), ::testing::HasSubstr("rim"));
                } else {
                    expect_bounds(with(x, y, levels));
                }
            }
        }
    }
}

TEST(LikelihoodPyramid, ToSearchByIsNeverLargerThanAPromisedSize) {
    for (const Point2& far : {Point2(400.0, 400.0), Point2(2e5, 0.0), Point2(30.0, 4e4)}) {
        const LikelihoodPyramid pyramid = search_pyramid({{0.0, 0.0}, far});
        EXPECT_LE(pyramid.finest().size(), std::size_t{1} << 24U) << far.transpose();
        EXPECT_LE(pyramid.levels(), 8);
        EXPECT_EQ(match_score(pyramid, {{0.0, 0.0}, far}, {}), 1.0);
    }
    EXPECT_EQ(search_pyramid({{0, 0}, {50.0, 30.0}}).geometry().resolution, 0.1);
}

}  // namespace
}  // namespace hybrid_slam::test
