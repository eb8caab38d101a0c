// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/localization/reference_map.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/registration/icp.hpp"
#include "support/error_of.hpp"
#include "support/room.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using ::testing::HasSubstr;

/// A map of the room at true poses.
StoredMap map_of(const World& world, const Trajectory& truth, double sigma, unsigned seed = 1) {
    test::Rng rng(seed);
    test::Lidar lidar;
    lidar.sigma = sigma;
    lidar.robot_from_laser = {0.3, 0.1, 0.2};
    StoredMap map;
    for (const StampedPose& pose : truth) {
        Keyframe keyframe;
        keyframe.stamp = pose.stamp;
        keyframe.robot_from_laser = lidar.robot_from_laser;
        keyframe.surface = test::surface_of(test::scan_at(world, pose.pose, lidar, rng));
        map.keyframes.push_back(std::move(keyframe));
        map.graph.nodes.push_back(pose.pose);
    }
    map.grid = to_states(draw_grid(map.keyframes, map.graph));
    return map;
}

/// Text rows from the top: '#' occupied, '.' free, ' ' unknown.
StateGrid drawn(const std::vector<std::string>& rows, double resolution = 0.05) {
    StateGrid grid;
    grid.geometry.resolution = resolution;
    grid.geometry.width = static_cast<int>(rows.front().size());
    grid.geometry.height = static_cast<int>(rows.size());
    for (auto row = rows.rbegin(); row != rows.rend(); ++row) {
        for (const char cell : *row) {
            grid.states.push_back(cell == '#'   ? CellState::kOccupied
                                  : cell == '.' ? CellState::kFree
                                                : CellState::kUnknown);
        }
    }
    return grid;
}

/// 2 x 1 m of free space with a wall across it, its lower side at y = 0.4 m.
StateGrid wall_of_thickness(int cells) {
    std::vector<std::string> rows(20, std::string(40, '.'));
    std::fill_n(rows.end() - 8 - cells, cells, std::string(40, '#'));
    return drawn(rows);
}

/// How far a wall lies before the world's, along its normal; nothing for what is not a wall there.
std::optional<double> offset_of(const Surface& walls, std::size_t i, const World& world) {
    constexpr double kBefore = 0.2;
    if (walls.normals[i].isZero(0.0)) {
        return std::nullopt;
    }
    const Point2 before = walls.points[i] + kBefore * walls.normals[i];
    const double offset = kBefore - world.cast_ray(before, -walls.normals[i]);
    return std::abs(offset) < kBefore ? std::optional(offset) : std::nullopt;
}

/// Metres, RMS over the poses in the room from which scans are aligned to the map.
double icp_error(const ReferenceMap& map, const World& world) {
    test::Lidar lidar;
    lidar.sigma = 0.02;
    test::Rng rng(77);
    constexpr int kPoses = 30;
    double squares = 0.0;
    for (int i = 0; i < kPoses; ++i) {
        const Pose2d pose(test::uniform(rng, -1.5, 1.5), test::uniform(rng, -1.0, 1.0),
                          test::uniform(rng, -kPi, kPi));
        const Surface scan = test::surface_of(test::scan_at(world, pose, lidar, rng));
        const Pose2d found =
            align(scan, map.reference(), pose * Pose2d(0.05, -0.05, 0.02)).reference_from_points;
        squares += (found.translation - pose.translation).squaredNorm();
    }
    return std::sqrt(squares / kPoses);
}

StateGrid free_grid() {
    return drawn({"..", ".."});
}

TEST(ReferenceMap, FindsTheNearestPointAsATrialOfAllDoes) {
    test::Rng rng(3);
    Surface walls;
    for (int i = 0; i < 200; ++i) {
        walls.points.emplace_back(test::uniform(rng, -3.0, 2.0), test::uniform(rng, 1.0, 5.0));
        walls.normals.emplace_back(1.0, 0.0);
    }
    const ReferenceMap map(walls, free_grid(), search_pyramid(walls.points));
    // Cells lie on whole multiples of 5 cm.
    const auto middle = [](double value) { return 0.05 * (std::floor(value / 0.05) + 0.5); };
    int without = 0;
    for (int i = 0; i < 5000; ++i) {
        const Point2 asked(test::uniform(rng, -4.0, 3.0), test::uniform(rng, 0.0, 6.0));
        const Point2 center(middle(asked.x()), middle(asked.y()));
        double nearest = ReferenceMap::kNear;
        for (const Point2& point : walls.points) {
            nearest = std::min(nearest, (point - center).norm());
        }
        const std::uint32_t found = map.nearest(asked);
        if (found == ReferenceMap::kNothing) {
            ++without;
            EXPECT_EQ(nearest, ReferenceMap::kNear) << asked.transpose();
        } else {
            EXPECT_NEAR((walls.points[found] - center).norm(), nearest, 1e-9);
        }
    }
    EXPECT_GT(without, 500);
    EXPECT_LT(without, 4500);
    EXPECT_EQ(map.nearest({1e300, NAN}), ReferenceMap::kNothing);
}

TEST(ReferenceMap, OneStrayPointDoesNotCostTheTable) {
    const Surface walls{{{0.0, 0.0}, {3000.0, 3000.0}}, {{1.0, 0.0}, {1.0, 0.0}}};
    const LikelihoodPyramid any({{0.0, 0.0}}, 0.1, 0.1, 1);
    const ReferenceMap map(walls, free_grid(), any);
    EXPECT_EQ(map.nearest({0.0, 0.0}), 0U);
    EXPECT_EQ(map.nearest({3000.0, 3000.0}), 1U);
    EXPECT_EQ(map.nearest({1000.0, 1000.0}), ReferenceMap::kNothing);
}

TEST(ReferenceMap, RefusesAMapWithoutWalls) {
    const LikelihoodPyramid any({{0.0, 0.0}}, 0.1, 0.1, 1);
    EXPECT_THAT(error_of([&] { ReferenceMap({}, free_grid(), any); }), HasSubstr("no walls"));
    EXPECT_THAT(error_of([&] {
                    ReferenceMap({{{0.0, 0.0}}, {}}, free_grid(), any);
                }),
                HasSubstr("no walls"));
    EXPECT_THAT(error_of([&] { reference_of(free_grid()); }), HasSubstr("no walls"));
    EXPECT_THAT(error_of([&] { reference_of(drawn({"##", "  "})); }), HasSubstr("no walls"));
    EXPECT_THAT(error_of([&] { reference_of(StateGrid{}); }), HasSubstr("no cells"));
    StateGrid torn = free_grid();
    torn.states.pop_back();
    EXPECT_THAT(error_of([&] { reference_of(torn); }), HasSubstr("no cells"));

    StoredMap blind;
    blind.keyframes.resize(1);
    blind.graph.nodes.resize(1);
    EXPECT_THAT(error_of([&] { reference_of(blind); }), HasSubstr("no walls"));
}

TEST(SearchPyramid, HasBlocksOfAnEighthOfTheMap) {
    const auto levels = [](double side) {
        return search_pyramid({{0.0, 0.0}, {side, 0.0}}).levels();
    };
    EXPECT_EQ(levels(0.1), 1);
    EXPECT_EQ(levels(25.6), 6);  // blocks of 3.2 m
    EXPECT_EQ(levels(25.7), 7);
    EXPECT_EQ(levels(300.0), 8);
    EXPECT_EQ(search_pyramid({{0.0, 0.0}}).geometry().resolution, 0.1);
    // One stray point must not cost the memory of the vehicle.
    const GridGeometry coarse = search_pyramid({{0.0, 0.0}, {3000.0, 3000.0}}).geometry();
    EXPECT_EQ(coarse.resolution, 0.8);
    EXPECT_LT(coarse.width, 4200);
    EXPECT_THROW(search_pyramid({}), Error);
}

/// Of the points that have one.
struct WallOffsets {
    double count = 0.0;
    double mean = 0.0;  ///< metres
    double rms = 0.0;   ///< metres
};

WallOffsets wall_offsets_of(const Surface& surface, const World& world) {
    WallOffsets offsets;
    double squares = 0.0;
    for (std::size_t i = 0; i < surface.size(); ++i) {
        if (const auto offset = offset_of(surface, i, world)) {
            offsets.mean += *offset;
            squares += *offset * *offset;
            offsets.count += 1.0;
        }
    }
    offsets.mean /= offsets.count;
    offsets.rms = std::sqrt(squares / offsets.count);
    return offsets;
}

TEST(ReferenceOfStoredMap, LiesOnTheWallsAndFacesTheRoom) {
    const World world = test::irregular_room();
    const StoredMap stored = map_of(world, test::ellipse_lap(40), 0.02);
    const auto map = reference_of(stored);
    const WallOffsets offsets = wall_offsets_of(map->surface(), world);
    EXPECT_GT(offsets.count, 0.97 * static_cast<double>(map->surface().size()));
    EXPECT_LT(std::abs(offsets.mean), 0.002);
    EXPECT_LT(offsets.rms, 0.012);
    EXPECT_LT(icp_error(*map, world), 0.004);
    EXPECT_EQ(map->grid().states, stored.grid.states);
}

TEST(ReferenceOfStoredMap, LeavesOutWhatHasMovedOn) {
    const World world = test::irregular_room();
    StoredMap stored = map_of(world, test::ellipse_lap(40), 0.0);
    const std::size_t walls = draw_walls(stored.keyframes, stored.graph, stored.grid).size();
    Surface person;
    for (int i = 0; i < 10; ++i) {
        person.points.emplace_back(1.0, 0.03 * i);
        person.normals.emplace_back(-1.0, 0.0);
    }
    stored.keyframes.front().surface.append(
        transform(stored.graph.nodes.front().inverse(), person));
    EXPECT_EQ(draw_walls(stored.keyframes, stored.graph, stored.grid).size(), walls);
    EXPECT_GT(draw_surface(stored.keyframes, stored.graph, 0.05).size(), walls);
}

TEST(ReferenceOfStoredMap, KeepsAPostButNoLonePointsOfWalls) {
    StoredMap stored;
    stored.graph.nodes.resize(1);
    Keyframe keyframe;
    keyframe.surface.points = {{1.0, 0.0}, {1.0, 0.1}, {3.0, 0.0}};
    keyframe.surface.normals = {{-1.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}};
    stored.keyframes = {keyframe};
    const auto map = reference_of(stored);
    ASSERT_EQ(map->surface().size(), 2U);
    EXPECT_EQ(map->surface().points[1], Point2(3.0, 0.0));
    EXPECT_TRUE(map->surface().normals[1].isZero(0.0));
}

TEST(ReferenceOfGrid, GivesAThickWallTwoFaces) {
    for (const int cells : {1, 2, 5}) {
        const auto map = reference_of(wall_of_thickness(cells));
        ASSERT_EQ(map->surface().size(), 80U) << cells;
        for (std::size_t i = 0; i < map->surface().size(); ++i) {
            const bool upper = map->surface().normals[i].y() > 0.0;
            EXPECT_LT((map->surface().normals[i] - Point2(0.0, upper ? 1.0 : -1.0)).norm(), 1e-9);
            // Half a cell inside of each face.
            EXPECT_NEAR(map->surface().points[i].y(), upper ? 0.375 + 0.05 * cells : 0.425, 1e-9);
        }
    }
}

TEST(ReferenceOfGrid, StraightensTheStairsOfSlantedWalls) {
    const World world = test::irregular_room();  // none of its walls is along an axis
    const auto map = reference_of(map_of(world, test::ellipse_lap(40), 0.0).grid);
    const WallOffsets offsets = wall_offsets_of(map->surface(), world);
    EXPECT_GT(offsets.count, 0.95 * static_cast<double>(map->surface().size()));
    EXPECT_LT(std::abs(offsets.mean), 0.006);
    EXPECT_LT(offsets.rms, 0.015);  // uniform in a cell would be this
    EXPECT_LT(icp_error(*map, world), 0.005);
}

TEST(ReferenceOfGrid, KeepsTheSidesOfCorners) {
    std::vector<std::string> rows(30, std::string(30, '.'));
    for (int y = 10; y < 20; ++y) {
        std::fill_n(rows[static_cast<std::size_t>(y)].begin() + 10, 10, '#');
    }
    const auto map = reference_of(drawn(rows));
    EXPECT_EQ(map->surface().size(), 40U);
    for (const Point2& normal : map->surface().normals) {
        EXPECT_GT(normal.cwiseAbs().maxCoeff(), std::cos(radians(3.0))) << normal.transpose();
    }
}

TEST(ReferenceOfGrid, HasNoWallsTowardsTheUnknown) {
    const auto map = reference_of(drawn({"    ", "####", "....", "...."}));
    ASSERT_EQ(map->surface().size(), 4U);
    for (const Point2& normal : map->surface().normals) {
        EXPECT_LT((normal - Point2(0.0, -1.0)).norm(), 1e-9);
    }
}

TEST(ReferenceOfGrid, TurnsAMapWithYaw) {
    const StateGrid straight = map_of(test::irregular_room(), test::ellipse_lap(40), 0.01).grid;
    StateGrid turned = straight;
    turned.geometry.origin = {3.0, -2.0};
    turned.origin_yaw = 0.7;
    const auto before = reference_of(straight);
    const auto after = reference_of(turned);
    const Pose2d after_from_before =
        Pose2d(3.0, -2.0, 0.7) * Pose2d(straight.geometry.origin, 0.0).inverse();
    ASSERT_EQ(after->surface().size(), before->surface().size());
    for (std::size_t i = 0; i < before->surface().size(); ++i) {
        EXPECT_LT(
            (after->surface().points[i] - after_from_before * before->surface().points[i]).norm(),
            1e-9);
        EXPECT_LT((after->surface().normals[i] -
                   after_from_before.rotation() * before->surface().normals[i])
                      .norm(),
                  1e-9);
    }
    EXPECT_EQ(after->grid().origin_yaw, 0.0);
    // Nearest cells differ along borders, but no wall gets lost.
    int same = 0;
    int lost = 0;
    int cells = 0;
    for (int y = 0; y < straight.geometry.height; ++y) {
        for (int x = 0; x < straight.geometry.width; ++x) {
            const Point2 there = after_from_before * straight.geometry.center_of({x, y});
            const CellState found = after->grid().at(after->grid().geometry.cell_of(there));
            const CellState wanted = straight.at({x, y});
            ++cells;
            same += found == wanted ? 1 : 0;
            lost += wanted == CellState::kOccupied && found != CellState::kOccupied ? 1 : 0;
        }
    }
    EXPECT_GT(same, 95 * cells / 100);
    EXPECT_EQ(lost, 0);
}

TEST(ReferenceMap, APyramidOfAnotherMapIsRefused) {
    StoredMap stored = map_of(test::irregular_room(), test::ellipse_lap(20), 0.01);
    const Surface walls = draw_walls(stored.keyframes, stored.graph, stored.grid);
    stored.pyramid = search_pyramid(walls.points);
    EXPECT_NO_THROW(reference_of(stored));
    Points elsewhere = walls.points;
    for (Point2& point : elsewhere) {
        point += Point2(0.7, 0.4);
    }
    stored.pyramid = search_pyramid(elsewhere);
    EXPECT_THROW(reference_of(stored), Error);
}

TEST(ReadReferenceMap, ReadsFoldersAndMapsOfOthers) {
    const test::TempFolder folder;
    const StoredMap stored = map_of(test::irregular_room(), test::ellipse_lap(20), 0.01);
    SlamMap map;
    map.keyframes = stored.keyframes;
    map.graph = stored.graph;
    map.trajectory = test::ellipse_lap(20);
    map.odometry_trajectory = map.trajectory;
    MapFolderWriter writer(folder / "hall");
    write_map(writer.path(), map);
    writer.commit();

    const auto ours = read_reference_map(folder / "hall");
    const auto theirs = read_reference_map(folder / "hall" / "map.yaml");
    EXPECT_EQ(ours->surface().size(), reference_of(stored)->surface().size());
    EXPECT_EQ(theirs->surface().points, reference_of(stored.grid)->surface().points);
    EXPECT_EQ(theirs->grid().states, ours->grid().states);
    EXPECT_THROW(read_reference_map(folder / "no.yaml"), Error);
    EXPECT_THROW(read_reference_map(folder / "no"), Error);
}

}  // namespace
}  // namespace hybrid_slam
