// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vehicle/clearance.hpp"

#include <gtest/gtest.h>

#include <random>

#include "halls.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam::test {
namespace {

/// Some of it free, occupied and unknown, none of it square or at the origin.
StateGrid litter(unsigned seed, double share) {
    std::mt19937 random(seed);
    StateGrid grid;
    grid.geometry.resolution = 0.1;
    grid.geometry.origin = {-1.23, 4.56};
    grid.geometry.width = 37;
    grid.geometry.height = 23;
    grid.states.assign(37 * 23, CellState::kFree);
    std::uniform_real_distribution<double> chance(0.0, 1.0);
    for (CellState& state : grid.states) {
        if (chance(random) < share) {
            state = chance(random) < 0.5 ? CellState::kOccupied : CellState::kUnknown;
        }
    }
    return grid;
}

/// By looking at each cell, with a frame of them around the grid.
double true_distance(const StateGrid& grid, const Point2& point) {
    double nearest = HUGE_VAL;
    for (int y = -1; y <= grid.geometry.height; ++y) {
        for (int x = -1; x <= grid.geometry.width; ++x) {
            if (grid.at({x, y}) != CellState::kFree) {
                nearest = std::min(nearest, distance_to_cell(grid.geometry, point, {x, y}));
            }
        }
    }
    return nearest;
}

TEST(ClearanceField, IsExactAtTheMiddleOfEachCell) {
    for (const double share : {0.0, 0.002, 0.02, 0.4, 1.0}) {
        const StateGrid grid = litter(3, share);
        const ClearanceField field(grid);
        for (int y = 0; y < grid.geometry.height; ++y) {
            for (int x = 0; x < grid.geometry.width; ++x) {
                const Point2 middle = grid.geometry.center_of({x, y});
                ASSERT_NEAR(field.at(middle), true_distance(grid, middle), 1e-6)
                    << share << " " << x << " " << y;
            }
        }
    }
}

TEST(ClearanceField, IsNeverMoreThanTheTruthNorMuchLess) {
    const StateGrid grid = litter(4, 0.02);
    const ClearanceField field(grid);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> x(-2.0, 3.0);
    std::uniform_real_distribution<double> y(4.0, 7.5);
    for (int i = 0; i < 2000; ++i) {
        const Point2 point(x(random), y(random));
        const double truth =
            grid.geometry.contains(grid.geometry.cell_of(point)) ? true_distance(grid, point) : 0.0;
        ASSERT_LE(field.at(point), truth + 1e-6);
        ASSERT_GE(field.at(point), truth - 0.1 * std::sqrt(2.0) - 1e-6);
    }
}

TEST(ClearanceField, OutsideAndNowhereAreBlocked) {
    const ClearanceField field(room(2.0, 2.0));
    EXPECT_LT(field.at({5.0, 0.0}), 0.0);
    EXPECT_LT(field.at({0.0, -1e12}), 0.0);
    EXPECT_LT(field.at({NAN, 0.0}), 0.0);
}

TEST(ClearanceField, TurnedMapsAreReadInTheirFrame) {
    StateGrid grid = litter(6, 0.02);
    const ClearanceField upright(grid);
    grid.origin_yaw = 0.7;
    const ClearanceField turned(grid);
    const Pose2d map_from_grid(grid.geometry.origin, 0.7);
    for (const Point2& local : {Point2(0.5, 0.5), Point2(2.33, 1.71), Point2(3.6, 2.2)}) {
        EXPECT_NEAR(turned.at(map_from_grid * local), upright.at(grid.geometry.origin + local),
                    1e-6);
    }
}

TEST(ClearanceField, RefusesAGridThatIsNotOne) {
    StateGrid grid = room(1.0, 1.0);
    grid.states.pop_back();
    EXPECT_EQ(error_of([&] { ClearanceField field(grid); }),
              "grid to drive in: its states do not fit its size");
    EXPECT_NE(error_of([] { ClearanceField field(StateGrid{}); }), "");
}

/// Random poses near random litter, against a test of every cell.
TEST(Footprint, IsNeverOptimisticAndHardlyPessimistic) {
    const VehicleConfig vehicle;
    StateGrid grid = room(12.0, 9.0);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> x(-6.5, 6.5);
    std::uniform_real_distribution<double> y(-5.0, 5.0);
    std::uniform_real_distribution<double> heading(-kPi, kPi);
    for (int i = 0; i < 12; ++i) {
        add_box(grid, {x(random), y(random)}, {0.08, 0.08},
                i % 2 == 0 ? CellState::kOccupied : CellState::kUnknown);
    }
    const ClearanceField field(grid);
    int clear = 0;
    int too_careful = 0;
    for (int i = 0; i < 5000; ++i) {
        const Pose2d pose(x(random), y(random), heading(random));
        const bool said_clear = footprint_is_clear(field, vehicle, pose, 0.0);
        clear += said_clear ? 1 : 0;
        ASSERT_FALSE(said_clear && touches(grid, vehicle, pose)) << pose;
        too_careful += !said_clear && !touches(grid, vehicle, pose, 0.1) ? 1 : 0;
    }
    EXPECT_GT(clear, 300);
    EXPECT_EQ(too_careful, 0) << "refused although nothing is within two cells";
}

TEST(Footprint, MarginsAndDistancesAgree) {
    const VehicleConfig vehicle;
    const ClearanceField field(room(10.0, 8.0));
    const Pose2d pose(0.0, 3.0, 0.0);
    const double clearance = footprint_clearance(field, vehicle, pose, 2.0);
    EXPECT_LE(clearance, 0.55 + 1e-6);
    EXPECT_GE(clearance, 0.55 - 0.09);
    EXPECT_TRUE(footprint_is_clear(field, vehicle, pose, clearance));
    EXPECT_FALSE(footprint_is_clear(field, vehicle, pose, 0.56));
    EXPECT_EQ(footprint_clearance(field, vehicle, pose, 0.3), 0.3);
    EXPECT_EQ(footprint_clearance(field, vehicle, Pose2d(0.0, 3.9, 0.0), 0.3), 0.0);
}

}  // namespace
}  // namespace hybrid_slam::test
