// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/occupancy_grid.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

GridGeometry square_grid(int cells, double resolution = 1.0) {
    GridGeometry geometry;
    geometry.resolution = resolution;
    geometry.width = cells;
    geometry.height = cells;
    return geometry;
}

double log_odds(double probability) {
    return std::log(probability / (1.0 - probability));
}

TEST(OccupancyGrid, StartsUnknown) {
    const OccupancyGrid grid(square_grid(3));
    EXPECT_EQ(grid.probability({1, 1}), 0.5);
    EXPECT_FALSE(grid.is_observed({1, 1}));
    EXPECT_EQ(grid.probability({-1, 5}), 0.5);
    EXPECT_FALSE(grid.is_observed({-1, 5}));
}

TEST(OccupancyGrid, ABeamFreesItsWayAndFillsItsEnd) {
    OccupancyGrid grid(square_grid(10));
    grid.insert({0.5, 0.5}, {{4.5, 0.5}});
    for (int x = 0; x < 4; ++x) {
        EXPECT_NEAR(grid.probability({x, 0}), 0.4, 1e-6) << x;
        EXPECT_TRUE(grid.is_observed({x, 0}));
    }
    EXPECT_NEAR(grid.probability({4, 0}), 0.65, 1e-6);
    EXPECT_FALSE(grid.is_observed({5, 0}));
    EXPECT_FALSE(grid.is_observed({2, 1}));
}

TEST(OccupancyGrid, ScansAddUpInLogOdds) {
    OccupancyGrid grid(square_grid(10));
    for (int i = 0; i < 3; ++i) {
        grid.insert({0.5, 0.5}, {{4.5, 0.5}});
    }
    const double expected = 1.0 / (1.0 + std::exp(-3.0 * log_odds(0.65)));
    EXPECT_NEAR(grid.probability({4, 0}), expected, 1e-6);
    for (int i = 0; i < 3; ++i) {
        grid.insert({0.5, 0.5}, {{6.5, 0.5}});
    }
    EXPECT_NEAR(log_odds(grid.probability({4, 0})), 3.0 * (log_odds(0.65) + log_odds(0.4)), 1e-5);
}

TEST(OccupancyGrid, IsClampedSoThatItCanChangeItsMind) {
    OccupancyGrid grid(square_grid(10));
    for (int i = 0; i < 100; ++i) {
        grid.insert({0.5, 0.5}, {{4.5, 0.5}});
    }
    EXPECT_NEAR(grid.probability({4, 0}), 0.98, 1e-6);
    EXPECT_NEAR(grid.probability({2, 0}), 0.02, 1e-6);
}

TEST(OccupancyGrid, OneScanChangesACellOnce) {
    OccupancyGrid grid(square_grid(10));
    grid.insert({0.5, 0.5}, {{4.5, 0.5}, {4.6, 0.6}, {4.5, 0.5}});
    EXPECT_NEAR(grid.probability({4, 0}), 0.65, 1e-6);
    EXPECT_NEAR(grid.probability({0, 0}), 0.4, 1e-6);
}

TEST(OccupancyGrid, ABeamDoesNotFreeWhatAnotherOfItsScanEndedIn) {
    const Point2 origin(0.5, 0.5);
    for (const Points& ends : {Points{{4.5, 0.5}, {8.5, 0.5}}, Points{{8.5, 0.5}, {4.5, 0.5}}}) {
        OccupancyGrid grid(square_grid(10));
        grid.insert(origin, ends);
        EXPECT_NEAR(grid.probability({4, 0}), 0.65, 1e-6);
        EXPECT_NEAR(grid.probability({6, 0}), 0.4, 1e-6);
        grid.insert(origin, {{8.5, 0.5}});
        EXPECT_LT(grid.probability({4, 0}), 0.6);
    }
}

TEST(OccupancyGrid, ALongBeamFreesUpToTheLimitOnly) {
    OccupancyGridConfig config;
    config.max_ray = 3.0;
    OccupancyGrid grid(square_grid(10), config);
    grid.insert({0.5, 0.5}, {{8.5, 0.5}});
    EXPECT_NEAR(grid.probability({3, 0}), 0.4, 1e-6);
    EXPECT_FALSE(grid.is_observed({4, 0}));
    EXPECT_FALSE(grid.is_observed({8, 0}));
}

TEST(OccupancyGrid, BeamsMayStartAndEndOutside) {
    OccupancyGrid grid(square_grid(4));
    grid.insert({-3.5, 1.5}, {{9.5, 1.5}, {-8.0, -8.0}});
    for (int x = 0; x < 4; ++x) {
        EXPECT_NEAR(grid.probability({x, 1}), 0.4, 1e-6);
        EXPECT_FALSE(grid.is_observed({x, 0}));
    }
}

TEST(OccupancyGrid, SkipsPointsThatAreNotFinite) {
    const double infinity = std::numeric_limits<double>::infinity();
    OccupancyGrid grid(square_grid(4));
    grid.insert({0.5, 0.5}, {{infinity, 0.5}, {0.5, std::nan("")}, {2.5, 0.5}});
    EXPECT_NEAR(grid.probability({2, 0}), 0.65, 1e-6);
    EXPECT_FALSE(grid.is_observed({3, 0}));
    EXPECT_FALSE(grid.is_observed({0, 1}));
    EXPECT_THROW(grid.insert({infinity, 0.0}, {}), Error);
}

TEST(OccupancyGrid, AgreesWithASlowOneMadeOfWalks) {
    std::mt19937 random(15);
    std::uniform_real_distribution<double> metres(-3.0, 13.0);
    const GridGeometry geometry = square_grid(40, 0.25);
    OccupancyGridConfig config;
    config.max_ray = 9.0;
    OccupancyGrid grid(geometry, config);
    std::vector<double> expected(1600, 0.0);
    for (int scan = 0; scan < 8; ++scan) {
        const Point2 origin(metres(random), metres(random));
        Points ends;
        std::vector<int> change(1600, 0);  // +1 ended in, -1 passed
        for (int beam = 0; beam < 60; ++beam) {
            ends.emplace_back(metres(random), metres(random));
            const double length = (ends.back() - origin).norm();
            const double share = length > 9.0 ? 9.0 / length : 1.0;
            for (const Cell& cell :
                 walk_ray(geometry, origin, origin + share * (ends.back() - origin))) {
                if (geometry.contains(cell) && change[geometry.index_of(cell)] == 0) {
                    change[geometry.index_of(cell)] = -1;
                }
            }
            const Cell end = geometry.cell_of(ends.back());
            if (length <= 9.0 && geometry.contains(end)) {
                change[geometry.index_of(end)] = 1;
            }
        }
        grid.insert(origin, ends);
        for (std::size_t i = 0; i < change.size(); ++i) {
            const double step = change[i] > 0   ? log_odds(0.65)
                                : change[i] < 0 ? log_odds(0.4)
                                                : 0.0;
            expected[i] = std::clamp(expected[i] + step, log_odds(0.02), log_odds(0.98));
        }
    }
    for (int y = 0; y < 40; ++y) {
        for (int x = 0; x < 40; ++x) {
            ASSERT_NEAR(log_odds(grid.probability({x, y})), expected[geometry.index_of({x, y})],
                        1e-5);
        }
    }
}

TEST(OccupancyGrid, RefusesNumbersThatMakeNoSense) {
    GridGeometry bad = square_grid(10);
    bad.resolution = 0.0;
    EXPECT_THROW(OccupancyGrid{bad}, Error);
    bad = square_grid(-1);
    EXPECT_THROW(OccupancyGrid{bad}, Error);
    bad = square_grid(100000);
    EXPECT_THROW(OccupancyGrid{bad}, Error);
    OccupancyGridConfig config;
    config.probability_hit = 0.4;
    EXPECT_THROW(OccupancyGrid(square_grid(1), config), Error);
    config = {};
    config.probability_max = 1.0;
    EXPECT_THROW(OccupancyGrid(square_grid(1), config), Error);
    config = {};
    config.max_ray = 0.0;
    EXPECT_THROW(OccupancyGrid(square_grid(1), config), Error);
}

TEST(ToStates, UsesTheThresholdsOfMapServer) {
    OccupancyGrid grid(square_grid(10));
    const Point2 origin(0.5, 0.5);
    grid.insert(origin, {{4.5, 0.5}});
    StateGrid once = to_states(grid);
    EXPECT_EQ(once.at({4, 0}), CellState::kUnknown);  // 0.65 is not above 0.65
    EXPECT_EQ(once.at({2, 0}), CellState::kUnknown);  // 0.4
    for (int i = 0; i < 3; ++i) {
        grid.insert(origin, {{4.5, 0.5}});
    }
    const StateGrid often = to_states(grid);
    EXPECT_EQ(often.at({4, 0}), CellState::kOccupied);
    EXPECT_EQ(often.at({2, 0}), CellState::kFree);
    EXPECT_EQ(often.at({7, 7}), CellState::kUnknown);
    EXPECT_EQ(often.at({-1, 0}), CellState::kUnknown);
    EXPECT_EQ(often.geometry.width, 10);
}

}  // namespace
}  // namespace hybrid_slam
