// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/occupancy_grid.hpp"

namespace hybrid_slam {

void PrintTo(const Cell& cell, std::ostream* out) {
    *out << "(" << cell.x << ", " << cell.y << ")";
}

namespace {

using ::testing::ElementsAre;

GridGeometry unit_grid() {
    GridGeometry geometry;
    geometry.resolution = 1.0;
    return geometry;
}

/// Whether the segment touches the closed square of the cell, grown by `slack` (slab method).
bool touches(const GridGeometry& geometry, const Cell& cell, const Point2& from, const Point2& to,
             double slack) {
    const Point2 center = geometry.center_of(cell);
    double enter = 0.0;
    double leave = 1.0;
    for (int axis = 0; axis < 2; ++axis) {
        const double low = center[axis] - 0.5 * geometry.resolution - slack;
        const double high = center[axis] + 0.5 * geometry.resolution + slack;
        const double way = to[axis] - from[axis];
        if (way == 0.0) {
            if (from[axis] < low || from[axis] > high) {
                return false;
            }
            continue;
        }
        const double first = (low - from[axis]) / way;
        const double second = (high - from[axis]) / way;
        enter = std::max(enter, std::min(first, second));
        leave = std::min(leave, std::max(first, second));
    }
    return enter <= leave;
}

/// What holds for any walk, and that no cell that samples of the ray lie in is left out.
void expect_right_walk(const GridGeometry& geometry, const Point2& from, const Point2& to) {
    const std::vector<Cell> cells = walk_ray(geometry, from, to);
    ASSERT_FALSE(cells.empty());
    EXPECT_EQ(cells.front(), geometry.cell_of(from));
    EXPECT_EQ(cells.back(), geometry.cell_of(to));
    std::set<std::pair<int, int>> seen;
    for (std::size_t i = 0; i < cells.size(); ++i) {
        EXPECT_TRUE(seen.emplace(cells[i].x, cells[i].y).second) << "twice";
        ASSERT_TRUE(touches(geometry, cells[i], from, to, 1e-9)) << "off the ray";
        if (i > 0) {
            const int steps =
                std::abs(cells[i].x - cells[i - 1].x) + std::abs(cells[i].y - cells[i - 1].y);
            ASSERT_EQ(steps, 1) << "neighbours must share an edge";
        }
    }
    constexpr int kSamples = 2000;
    for (int i = 0; i <= kSamples; ++i) {
        const Point2 sample = from + (to - from) * (static_cast<double>(i) / kSamples);
        const Cell cell = geometry.cell_of(sample);
        const Point2 off_center = (sample - geometry.center_of(cell)).cwiseAbs();
        const bool inside = off_center.maxCoeff() < 0.5 * geometry.resolution - 1e-9;
        ASSERT_TRUE(!inside || seen.count({cell.x, cell.y}) == 1) << "left out";
    }
}

TEST(WalkRay, VisitsTheCellsInOrder) {
    EXPECT_THAT(walk_ray(unit_grid(), {0.5, 0.5}, {2.5, 1.4}),
                ElementsAre(Cell{0, 0}, Cell{1, 0}, Cell{1, 1}, Cell{2, 1}));
    EXPECT_THAT(walk_ray(unit_grid(), {0.5, 0.5}, {-1.5, 0.5}),
                ElementsAre(Cell{0, 0}, Cell{-1, 0}, Cell{-2, 0}));
    EXPECT_THAT(walk_ray(unit_grid(), {0.5, 0.5}, {0.5, 2.5}),
                ElementsAre(Cell{0, 0}, Cell{0, 1}, Cell{0, 2}));
    EXPECT_THAT(walk_ray(unit_grid(), {0.2, 0.2}, {0.8, 0.3}), ElementsAre(Cell{0, 0}));
    EXPECT_THAT(walk_ray(unit_grid(), {0.2, 0.2}, {0.2, 0.2}), ElementsAre(Cell{0, 0}));
}

TEST(WalkRay, RandomRays) {
    std::mt19937 random(12);
    std::uniform_real_distribution<double> metres(-3.0, 3.0);
    for (const double resolution : {0.05, 0.1, 1.0}) {
        GridGeometry geometry;
        geometry.resolution = resolution;
        geometry.origin = {-1.2345, 0.777};
        for (int i = 0; i < 300; ++i) {
            const Point2 from(metres(random), metres(random));
            expect_right_walk(geometry, from, {metres(random), metres(random)});
            ASSERT_FALSE(::testing::Test::HasFailure()) << "ray " << i << " at " << resolution;
        }
    }
}

TEST(WalkRay, RaysAlongBordersThroughCornersAndAlmostParallelToAnAxis) {
    for (const double resolution : {0.05, 0.1, 1.0}) {
        GridGeometry geometry;
        geometry.resolution = resolution;
        for (int x = -6; x <= 6; ++x) {
            for (int y = -6; y <= 6; ++y) {
                for (const double tilt : {0.0, 1e-13, -1e-13, 1e-7, 0.5}) {
                    const Point2 from(resolution, -2.0 * resolution);
                    const Point2 to(resolution * x + tilt, resolution * y - tilt);
                    expect_right_walk(geometry, from, to);
                    expect_right_walk(geometry, to, from);
                }
            }
        }
    }
}

TEST(WalkRay, LongRaysDoNotDrift) {
    GridGeometry geometry;
    geometry.resolution = 0.01;
    expect_right_walk(geometry, {0.0001, 0.0003}, {400.0, 777.7777});
}

TEST(WalkRay, BothWaysPassAsManyCells) {
    std::mt19937 random(13);
    std::uniform_real_distribution<double> metres(-30.0, 30.0);
    for (int i = 0; i < 200; ++i) {
        const Point2 a(metres(random), metres(random));
        const Point2 b(metres(random), metres(random));
        auto there = walk_ray(unit_grid(), a, b);
        const auto back = walk_ray(unit_grid(), b, a);
        std::reverse(there.begin(), there.end());
        ASSERT_EQ(there, back);
    }
}

TEST(WalkRay, RefusesWhatHasNoEnd) {
    const double infinity = std::numeric_limits<double>::infinity();
    EXPECT_THROW(walk_ray(unit_grid(), {0.0, 0.0}, {infinity, 0.0}), Error);
    EXPECT_THROW(walk_ray(unit_grid(), {0.0, std::nan("")}, {0.0, 0.0}), Error);
    EXPECT_THROW(walk_ray(unit_grid(), {0.0, 0.0}, {1e9, 0.0}), Error);
}

TEST(GridGeometry, CellsAndCentersAgree) {
    GridGeometry geometry;
    geometry.resolution = 0.1;
    geometry.origin = {-3.0, 7.0};
    geometry.width = 20;
    geometry.height = 30;
    for (int x = -5; x < 25; ++x) {
        for (int y = -5; y < 35; ++y) {
            const Cell cell{x, y};
            ASSERT_EQ(geometry.cell_of(geometry.center_of(cell)), cell);
            ASSERT_EQ(geometry.contains(cell), x >= 0 && x < 20 && y >= 0 && y < 30);
        }
    }
    EXPECT_LT((geometry.center_of({0, 0}) - Point2(-2.95, 7.05)).norm(), 1e-12);
    EXPECT_EQ(geometry.index_of({3, 2}), 43U);
}

TEST(GridGeometry, FarAndBrokenPointsAreOutside) {
    GridGeometry geometry = unit_grid();
    geometry.width = geometry.height = 10;
    for (const double far : {1e300, -1e300, HUGE_VAL, -HUGE_VAL, std::nan("")}) {
        EXPECT_FALSE(geometry.contains(geometry.cell_of({far, 1.0}))) << far;
        EXPECT_FALSE(geometry.contains(geometry.cell_of({1.0, far}))) << far;
    }
}

TEST(GridGeometry, AroundHoldsBothCornersAndIsTheSmallest) {
    std::mt19937 random(14);
    std::uniform_real_distribution<double> metres(-20.0, 20.0);
    std::uniform_int_distribution<int> steps(-400, 400);
    for (int i = 0; i < 3000; ++i) {
        const double resolution = i % 3 == 0 ? 0.05 : i % 3 == 1 ? 0.1 : 0.07;
        const double margin = i % 2 == 0 ? 0.0 : 0.33;
        // Half of the corners lie on borders of cells, where rounding decides.
        const Point2 a = i % 4 < 2 ? Point2(metres(random), metres(random))
                                   : Point2(resolution * steps(random), resolution * steps(random));
        const Point2 b = i % 4 < 2 ? Point2(metres(random), metres(random))
                                   : Point2(resolution * steps(random), resolution * steps(random));
        const Point2 low = (a.cwiseMin(b).array() - margin).matrix();
        const Point2 high = (a.cwiseMax(b).array() + margin).matrix();
        const auto geometry = GridGeometry::around(a, b, resolution, margin);
        ASSERT_TRUE(geometry.contains(geometry.cell_of(low)));
        ASSERT_TRUE(geometry.contains(geometry.cell_of(high)));
        const Point2 multiple = geometry.origin / resolution;
        ASSERT_LT((multiple - Point2(multiple.array().round())).norm(), 1e-9);
        const Point2 size(geometry.width * resolution, geometry.height * resolution);
        ASSERT_LT(((size - (high - low)) / resolution).maxCoeff(), 2.0 + 1e-9);
    }
}

TEST(GridGeometry, AroundRefusesTooMuch) {
    const Point2 zero = Point2::Zero();
    EXPECT_NO_THROW(GridGeometry::around(zero, {700.0, 700.0}, 0.05, 0.0));
    EXPECT_THROW(GridGeometry::around(zero, {900.0, 900.0}, 0.05, 0.0), Error);
    EXPECT_THROW(GridGeometry::around(zero, {1e300, 1e300}, 0.05, 0.0), Error);
    EXPECT_THROW(GridGeometry::around(zero, {std::nan(""), 1.0}, 0.05, 0.0), Error);
    EXPECT_THROW(GridGeometry::around(zero, {1.0, 1.0}, 0.0, 0.0), Error);
    EXPECT_THROW(GridGeometry::around(zero, {1.0, 1.0}, 0.05, HUGE_VAL), Error);
    EXPECT_THROW(GridGeometry::around(zero, {1.0, 1.0}, 0.05, -1.0), Error);
}

}  // namespace
}  // namespace hybrid_slam
