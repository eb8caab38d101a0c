// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/map_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "hybrid_slam/core/text_file.hpp"
#include "map_support.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

using namespace test;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

TEST(DrawGrid, ARoomHasWallsAndIsFreeInside) {
    const SlamMap map = room(1440);
    const StateGrid grid = to_states(draw_grid(map.keyframes, map.graph));
    const GridGeometry& geometry = grid.geometry;
    EXPECT_FALSE(geometry.contains(geometry.cell_of({kHalfLength + 0.7, 0.0})));
    for (int y = 0; y < geometry.height; ++y) {
        for (int x = 0; x < geometry.width; ++x) {
            const Point2 center = geometry.center_of({x, y});
            // How far outside of the walls, in the axis in which it is farthest out.
            const double outside =
                std::max(std::abs(center.x()) - kHalfLength, std::abs(center.y()) - kHalfWidth);
            const CellState state = grid.at({x, y});
            if (outside < -0.01) {
                EXPECT_EQ(state, CellState::kFree) << center.transpose();
            } else if (outside > 0.01) {
                EXPECT_EQ(state, CellState::kUnknown) << center.transpose();
            } else if (std::abs(center.x()) < kHalfLength - 0.01 ||
                       std::abs(center.y()) < kHalfWidth - 0.01) {
                EXPECT_EQ(state, CellState::kOccupied) << center.transpose();
            }
        }
    }
}

TEST(DrawGrid, RaysStartAtTheLaser) {
    PoseGraph graph;
    graph.nodes = {Pose2d(1.0, 1.0, kPi / 2.0)};
    Keyframes keyframes(1);
    keyframes[0].robot_from_laser = {1.0, 0.0, 0.0};      // in the map at (1, 2)
    keyframes[0].surface = {{{1.0, 2.0}}, {{0.0, 0.0}}};  // in the map at (-1, 2)
    OccupancyGridConfig config;
    config.resolution = 0.1;
    const OccupancyGrid grid = draw_grid(keyframes, graph, config);
    const auto probability = [&](double x, double y) {
        return grid.probability(grid.geometry().cell_of({x, y}));
    };
    EXPECT_LT(probability(0.95, 2.0 + 1e-9), 0.5);
    EXPECT_NEAR(probability(-1.0 + 1e-9, 2.0 + 1e-9), config.probability_hit, 1e-6);
    EXPECT_EQ(probability(1.0, 1.0), 0.5) << "the robot's origin is not where the beams start";
}

TEST(DrawGrid, NeedsAKeyframeForEachNode) {
    const SlamMap map = room(5);
    PoseGraph shorter = map.graph;
    shorter.nodes.pop_back();
    error_of([&] { draw_grid(map.keyframes, shorter); });
    error_of([&] { draw_points(map.keyframes, shorter, 0.05); });
    error_of([&] { draw_grid({}, {}); });
    error_of([&] { draw_points(map.keyframes, map.graph, 0.0); });
}

TEST(DrawPoints, GivesTheMeanOfEachCell) {
    PoseGraph graph;
    graph.nodes = {Pose2d(10.0, 0.0, 0.0), Pose2d(0.0, -10.0, kPi / 2.0)};
    Keyframes keyframes(2);
    keyframes[0].surface.points = {{0.2, 0.3}, {0.4, 0.1}, {-0.5, 0.5}, {NAN, 0.0}};
    keyframes[1].surface.points = {{10.8, -10.6}};  // in the map at (10.6, 0.8)
    keyframes[0].surface.normals.assign(4, Point2::Zero());
    keyframes[1].surface.normals.assign(1, Point2::Zero());
    const Points points = draw_points(keyframes, graph, 1.0);
    ASSERT_THAT(points, SizeIs(2));
    EXPECT_LT((points[0] - Point2(10.4, 0.4)).norm(), 1e-9);
    EXPECT_LT((points[1] - Point2(9.5, 0.5)).norm(), 1e-9);
}

/// A wall along x at y = 0.02, seen with 2 cm of noise by many scans from above, and its other face
/// 10 cm below, seen from below.
TEST(DrawPoints, LieOnTheWallsAndNotAroundThem) {
    std::mt19937 random(3);
    std::normal_distribution<double> noise(0.0, 0.02);
    PoseGraph graph;
    Keyframes keyframes;
    for (int scan = 0; scan < 60; ++scan) {
        const bool above = scan % 2 == 0;
        Keyframe keyframe;
        for (double x = 0.025; x < 3.0; x += 0.05) {  // one in each cell
            keyframe.surface.points.emplace_back(x, (above ? 0.02 : -0.08) + noise(random));
            keyframe.surface.normals.emplace_back(0.0, above ? 1.0 : -1.0);
        }
        keyframes.push_back(keyframe);
        graph.nodes.emplace_back();
    }
    const Points points = draw_points(keyframes, graph, 0.05);
    EXPECT_LE(points.size(), 2U * 60U) << "one for each cell along either face";
    for (const Point2& point : points) {
        const double off = std::min(std::abs(point.y() - 0.02), std::abs(point.y() + 0.08));
        EXPECT_LT(off, 0.006) << point.transpose();
    }
}

TEST(DrawSurface, FacesTheSideThatTheWallWasSeenFrom) {
    SlamMap map;
    Keyframe from_left;
    Keyframe from_right;
    for (int i = 0; i < 5; ++i) {
        from_left.surface.points.emplace_back(2.0, 0.2 * i);
        from_left.surface.normals.emplace_back(-1.0, 0.0);
        from_right.surface.points.emplace_back(2.01, 0.2 * i);
        from_right.surface.normals.emplace_back(1.0, 0.0);
    }
    from_left.surface.points.emplace_back(1.0, 1.0);
    from_left.surface.normals.emplace_back(0.0, 0.0);
    // The second pose is turned: normals turn with their points.
    from_right.surface = transform(Pose2d(0.0, 0.0, 2.0).inverse(), from_right.surface);
    map.keyframes = {from_left, from_right};
    map.graph.nodes = {Pose2d(), Pose2d(0.0, 0.0, 2.0)};
    const Surface drawn = draw_surface(map.keyframes, map.graph, 0.05);
    ASSERT_EQ(drawn.size(), 11U);
    for (std::size_t i = 0; i < drawn.size(); ++i) {
        const Point2& point = drawn.points[i];
        const double side = point.x() < 1.5 ? 0.0 : point.x() < 2.005 ? -1.0 : 1.0;
        EXPECT_LT((drawn.normals[i] - Point2(side, 0.0)).norm(), 1e-9) << point.transpose();
    }
    EXPECT_EQ(drawn.points, draw_points(map.keyframes, map.graph, 0.05));
}

TEST(DrawPoints, StandInTheFileAsPly) {
    const TempFolder folder;
    const SlamMap map = room(30);
    write_map(folder.path(), map);
    const Points points = draw_points(map.keyframes, map.graph, 0.05);
    TextFileReader reader(folder / "points.ply");
    std::vector<std::string> lines;
    for (std::string line; reader.next(line);) {
        lines.push_back(line);
    }
    ASSERT_EQ(lines.size(), 8 + points.size());
    EXPECT_THAT(std::vector<std::string>(lines.begin(), lines.begin() + 8),
                ElementsAre("ply", "format ascii 1.0", HasSubstr("comment"),
                            fmt::format("element vertex {}", points.size()), "property float x",
                            "property float y", "property float z", "end_header"));
    for (std::size_t i = 0; i < points.size(); ++i) {
        EXPECT_EQ(lines[8 + i], fmt::format("{:.4f} {:.4f} 0", points[i].x(), points[i].y()));
    }
}

}  // namespace
}  // namespace hybrid_slam
