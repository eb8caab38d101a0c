// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/map_crop.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <random>
#include <vector>

#include "hybrid_slam/backend/point_cloud.hpp"
#include "map_support.hpp"
#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam {
namespace {

using namespace test;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

Points box(double x0, double y0, double x1, double y1) {
    return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
}

/// Keyframes 1 m apart along the way, each with one point a metre to either side of it.
StoredMap way_of(const std::vector<Pose2d>& poses) {
    StoredMap map;
    map.graph.nodes = poses;
    for (std::size_t i = 0; i < poses.size(); ++i) {
        Keyframe keyframe;
        keyframe.stamp = static_cast<double>(i);
        keyframe.path = static_cast<double>(i);
        keyframe.surface.points = {{0.0, 1.0}, {0.0, -1.0}};
        keyframe.surface.normals = {{0.0, -1.0}, {0.0, 1.0}};
        map.keyframes.push_back(keyframe);
        map.trajectory.push_back({keyframe.stamp, poses[i]});
        map.odometry_trajectory.push_back({keyframe.stamp, poses[i]});
        if (i > 0) {
            map.graph.edges.push_back(
                {i - 1, i, between(poses[i - 1], poses[i]), information(), EdgeKind::kOdometry});
        }
    }
    return map;
}

/// Ten poses on a straight line with a bend.
std::vector<Pose2d> bent_way() {
    std::vector<Pose2d> poses;
    Pose2d pose(0.5, 0.0, 0.1);
    for (int i = 0; i < 10; ++i) {
        poses.push_back(pose);
        pose = pose * Pose2d(1.0, 0.0, i == 5 ? 0.4 : -0.02);
    }
    return poses;
}

double stamp_of(const SlamMap& map, std::size_t node) {
    return map.keyframes[node].stamp;
}

TEST(MapArea, APolygonHoldsWhatIsLeftOfAllItsEdges) {
    std::mt19937 rng(1);
    std::uniform_real_distribution<double> any(-3.0, 3.0);
    const MapArea convex{{{-2.0, -1.0}, {1.0, -2.0}, {2.0, 1.5}, {-0.5, 2.0}}, false};
    const MapArea rest{convex.polygon, true};
    MapArea turned_round = convex;
    std::reverse(turned_round.polygon.begin(), turned_round.polygon.end());
    int inside = 0;
    for (int i = 0; i < 2000; ++i) {
        const Point2 point(any(rng), any(rng));
        bool left = true;
        for (std::size_t j = 0; j < 4; ++j) {
            const Point2 along = convex.polygon[(j + 1) % 4] - convex.polygon[j];
            const Point2 away = point - convex.polygon[j];
            left = left && along.x() * away.y() - along.y() * away.x() > 0.0;
        }
        inside += left ? 1 : 0;
        EXPECT_EQ(convex.contains(point), left) << point.transpose();
        EXPECT_EQ(turned_round.contains(point), left);
        EXPECT_EQ(rest.contains(point), !left);
    }
    EXPECT_GT(inside, 300);
    const MapArea horseshoe{{{0, 0}, {3, 0}, {3, 3}, {2, 3}, {2, 1}, {1, 1}, {1, 3}, {0, 3}},
                            false};
    EXPECT_TRUE(horseshoe.contains({0.5, 2.0}));
    EXPECT_FALSE(horseshoe.contains({1.5, 2.0}));
    EXPECT_TRUE(horseshoe.contains({2.5, 1.0}));  // level with two corners
    EXPECT_FALSE(horseshoe.contains({-1.0, 1.0}));
}

TEST(MapCrop, KeepsWhatIsInTheArea) {
    const StoredMap map = way_of(bent_way());
    const SlamMap part = crop(map, {box(1.0, -1.2, 5.0, 1.0), false});
    ASSERT_THAT(part.keyframes, SizeIs(4));
    ASSERT_THAT(part.graph.nodes, SizeIs(4));
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(stamp_of(part, i), 1.0 + static_cast<double>(i));
        EXPECT_EQ(part.keyframes[i].path, 1.0 + static_cast<double>(i));
        EXPECT_EQ(part.graph.nodes[i].vector(), map.graph.nodes[i + 1].vector());
        EXPECT_EQ(part.trajectory[i].stamp, part.keyframes[i].stamp);
        // The one to the left is beyond the upper border.
        EXPECT_THAT(part.keyframes[i].surface.points, ElementsAre(Point2(0.0, -1.0)));
        EXPECT_THAT(part.keyframes[i].surface.normals, ElementsAre(Point2(0.0, 1.0)));
    }
    EXPECT_THAT(part.trajectory, SizeIs(4));
    EXPECT_THAT(part.odometry_trajectory, SizeIs(4));
    ASSERT_THAT(part.graph.edges, SizeIs(3));
    EXPECT_EQ(part.graph.edges[2].from, 2U);
    EXPECT_EQ(part.graph.edges[2].from_from_to.vector(), map.graph.edges[3].from_from_to.vector());
}

TEST(MapCrop, ABridgeKnowsWhatTheChainKnew) {
    StoredMap map = way_of(bent_way());
    std::reverse(map.graph.edges.begin(), map.graph.edges.end());
    // One edge against the way.
    for (Edge& edge : map.graph.edges) {
        if (edge.from == 4) {
            edge = {5, 4, edge.from_from_to.inverse(), information(), EdgeKind::kOdometry};
        }
    }
    const SlamMap part = crop(map, {box(2.8, -9.0, 7.0, 9.0), true});
    ASSERT_THAT(part.graph.nodes, SizeIs(map.graph.nodes.size() - 4));
    ASSERT_EQ(stamp_of(part, 2), 2.0);
    ASSERT_EQ(stamp_of(part, 3), 7.0);
    const auto bridge = std::find_if(part.graph.edges.begin(), part.graph.edges.end(), [](auto& e) {
        return std::min(e.from, e.to) == 2 && std::max(e.from, e.to) == 3;
    });
    ASSERT_NE(bridge, part.graph.edges.end());
    EXPECT_THAT(part.graph.edges, SizeIs(part.graph.nodes.size() - 1));
    EXPECT_LT(chi2(part.graph), 1e-18);
    // The oracle: what the whole graph says of the two nodes.
    const Eigen::Matrix3d before = relative_covariance(map.graph, 2, 7);
    const Eigen::Matrix3d after = relative_covariance(part.graph, 2, 3);
    EXPECT_LT((after - before).norm(), 1e-4 * before.norm());
}

TEST(MapCrop, TheRestStaysInOnePieceAndInItsPlace) {
    // A square of 8 m, around twice, with closures between the laps and noise in all edges.
    std::vector<Pose2d> poses;
    Pose2d pose;
    for (int i = 0; i < 64; ++i) {
        poses.push_back(pose);
        pose = pose * Pose2d(1.0, 0.0, i % 8 == 7 ? kPi / 2.0 : 0.0);
    }
    StoredMap map = way_of(poses);
    for (std::size_t i = 0; i < 32; i += 4) {
        map.graph.edges.push_back({i, i + 32, Pose2d(), information(), EdgeKind::kClosure});
    }
    std::mt19937 rng(5);
    std::normal_distribution<double> noise(0.0, 0.02);
    for (Edge& edge : map.graph.edges) {
        edge.from_from_to = edge.from_from_to * Pose2d(noise(rng), noise(rng), noise(rng));
    }
    optimize(map.graph);
    map.graph.fixed = {3};
    map.graph.priors.push_back({40, map.graph.nodes[40], information()});

    // Both ends of a stripe: four pieces of way that are joined beyond it, or by closures.
    const SlamMap part = crop(map, {box(2.5, -2.0, 5.5, 11.0), true});
    ASSERT_LT(part.graph.nodes.size(), 60U);
    ASSERT_GT(part.graph.nodes.size(), 40U);
    std::vector<std::size_t> piece(part.graph.nodes.size());
    for (std::size_t i = 0; i < piece.size(); ++i) {
        piece[i] = i;
    }
    for (std::size_t round = 0; round < piece.size(); ++round) {
        for (const Edge& edge : part.graph.edges) {
            piece[edge.from] = piece[edge.to] = std::min(piece[edge.from], piece[edge.to]);
        }
    }
    EXPECT_EQ(*std::max_element(piece.begin(), piece.end()), 0U);
    EXPECT_THAT(part.graph.fixed, SizeIs(0));  // node 3 is in the stripe
    ASSERT_THAT(part.graph.priors, SizeIs(1));
    EXPECT_EQ(stamp_of(part, part.graph.priors[0].node), 40.0);

    PoseGraph again = part.graph;
    ASSERT_TRUE(optimize(again).usable);
    for (std::size_t i = 0; i < again.nodes.size(); ++i) {
        // Within what the edges that are left can tell: some of the closures are gone.
        EXPECT_THAT(again.nodes[i], PoseNear(part.graph.nodes[i], 0.2, 0.1)) << i;
    }
}

TEST(MapCrop, CanBeStoredAndReadAgain) {
    const TempFolder folder;
    const SlamMap whole = room(40);
    store(folder / "hall", whole);
    const SlamMap part = crop(read_map(folder / "hall"), {box(-0.7, -2.0, 3.0, 2.0), false});
    store(folder / "part", part);
    const StoredMap again = read_map(folder / "part");
    EXPECT_EQ(again.keyframes.size(), part.keyframes.size());
    EXPECT_LT(again.keyframes.size(), whole.keyframes.size());
    for (std::size_t i = 0; i < again.graph.edges.size(); ++i) {
        EXPECT_EQ(again.graph.edges[i].kind, part.graph.edges[i].kind);
    }
    for (const Point2& point : draw_points(again.keyframes, again.graph, 0.05)) {
        EXPECT_GT(point.x(), -0.75);
    }
}

TEST(MapCrop, NothingLeftIsAnError) {
    const StoredMap map = way_of(bent_way());
    EXPECT_THAT(error_of([&] {
                    crop(map, {box(100.0, 0.0, 101.0, 1.0), false});
                }),
                HasSubstr("nothing would be left"));
    EXPECT_THAT(error_of([&] {
                    crop(map, {box(-99.0, -99.0, 99.0, 99.0), true});
                }),
                HasSubstr("nothing would be left"));
    EXPECT_THAT(error_of([&] {
                    crop(map, {{{0.0, 0.0}, {1.0, 1.0}}, false});
                }),
                HasSubstr("three corners"));
}

TEST(PointCloud, FilesAreAsViewersExpectThem) {
    const TempFolder folder;
    const Points points{{1.0, -2.5}, {0.00004, 1e3}};
    write_pcd(folder / "a.pcd", points);
    EXPECT_EQ(bytes_of(folder / "a.pcd"),
              "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\n"
              "TYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\n"
              "DATA ascii\n1.0000 -2.5000 0\n0.0000 1000.0000 0\n");
    write_ply(folder / "a.ply", points);
    EXPECT_EQ(bytes_of(folder / "a.ply"),
              "ply\nformat ascii 1.0\ncomment hybrid_slam point map, metres\nelement vertex 2\n"
              "property float x\nproperty float y\nproperty float z\nend_header\n"
              "1.0000 -2.5000 0\n0.0000 1000.0000 0\n");
    EXPECT_THROW(write_pcd(folder / "no/such.pcd", points), Error);
}

}  // namespace
}  // namespace hybrid_slam
