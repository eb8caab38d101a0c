// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "hybrid_slam/backend/map_folder.hpp"
#include "map_files.hpp"
#include "map_support.hpp"
#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"

// Folders that earlier versions of the program wrote; they must load for ever. Both are of the same
// drive of two laps through a room of 4 x 3 m, keyframes 0.8 m apart.
namespace hybrid_slam {
namespace {

namespace fs = std::filesystem;
using namespace test;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::SizeIs;

fs::path golden(int version) {
    return fs::path(HYBRID_SLAM_SOURCE_DIR) / "tests/backend/data" /
           ("map_v" + std::to_string(version));
}

class GoldenMap : public ::testing::TestWithParam<int> {};

TEST_P(GoldenMap, HoldsWhatWasPutIntoIt) {
    const StoredMap map = read_map(golden(GetParam()));
    EXPECT_EQ(map.version, GetParam());
    ASSERT_THAT(map.keyframes, SizeIs(19));
    EXPECT_THAT(map.graph.nodes, SizeIs(19));
    EXPECT_THAT(map.graph.edges, SizeIs(22));
    EXPECT_EQ(std::count_if(map.graph.edges.begin(), map.graph.edges.end(),
                            [](const Edge& edge) { return edge.kind == EdgeKind::kClosure; }),
              4);
    EXPECT_THAT(map.trajectory, SizeIs(156));
    EXPECT_THAT(map.odometry_trajectory, SizeIs(156));
    EXPECT_NEAR(length_of(map.trajectory), 12.215721, 1e-6);

    const Keyframe& last = map.keyframes.back();
    EXPECT_EQ(last.stamp, 29.2);
    EXPECT_NEAR(last.path, 11.4862320707, 1e-9);
    EXPECT_THAT(last.local_from_robot,
                PoseNear(Pose2d{0.0709042936, 0.7402993997, -2.1670989454}, 1e-9, 1e-9));
    EXPECT_THAT(map.graph.nodes.back(),
                PoseNear(Pose2d{0.0712585593, 0.7410499608, -2.1670878979}, 1e-9, 1e-9));
    ASSERT_THAT(last.surface.points, SizeIs(73));
    EXPECT_LT((last.surface.points[10] - Point2(0.380356431007, -0.815676987171)).norm(), 1e-9);
    EXPECT_LT((last.surface.normals[10] - Point2(-0.648978948593, 0.760806381702)).norm(), 1e-9);

    EXPECT_EQ(map.grid.geometry.resolution, 0.1);
    EXPECT_EQ(map.grid.geometry.width, 52);
    EXPECT_EQ(map.grid.geometry.height, 42);
    EXPECT_EQ(std::count(map.grid.states.begin(), map.grid.states.end(), CellState::kFree), 969);
    EXPECT_EQ(map.pyramid.has_value(), GetParam() >= 2);
}

TEST_P(GoldenMap, CanBeWrittenAgainAsItIsNow) {
    const StoredMap map = read_map(golden(GetParam()));
    const TempFolder folder;
    MapFolderWriter writer(folder / "hall");
    write_map(writer.path(),
              {map.keyframes, map.graph, {}, map.trajectory, map.odometry_trajectory},
              {map.grid.geometry.resolution});
    writer.commit();
    const StoredMap again = read_map(folder / "hall");
    EXPECT_EQ(again.version, kMapFormatVersion);
    EXPECT_TRUE(again.pyramid);
    for (const char* name : {"keyframes.bin", "graph.g2o", "map.yaml", "map.pgm", "points.ply"}) {
        EXPECT_EQ(bytes_of(folder / "hall" / name), bytes_of(golden(GetParam()) / name)) << name;
    }
}

INSTANTIATE_TEST_SUITE_P(Versions, GoldenMap, ::testing::Range(1, kMapFormatVersion + 1));

TEST(MapVersions, ThePyramidIsTheOneOfTheWalls) {
    const StoredMap map = read_map(golden(2));
    const LikelihoodPyramid expected =
        search_pyramid(draw_walls(map.keyframes, map.graph, map.grid).points);
    ASSERT_TRUE(map.pyramid);
    ASSERT_EQ(map.pyramid->levels(), expected.levels());
    EXPECT_EQ(map.pyramid->geometry().origin, expected.geometry().origin);
    EXPECT_EQ(map.pyramid->geometry().resolution, expected.geometry().resolution);
    ASSERT_EQ(map.pyramid->geometry().width, expected.geometry().width);
    ASSERT_EQ(map.pyramid->geometry().height, expected.geometry().height);
    for (int level = 0; level < expected.levels(); ++level) {
        for (int y = 0; y < expected.geometry().height; ++y) {
            for (int x = 0; x < expected.geometry().width; ++x) {
                ASSERT_EQ(map.pyramid->at(level, x, y), expected.at(level, x, y))
                    << level << ": " << x << ", " << y;
            }
        }
    }
}

TEST(MapVersions, ANewerOneIsRefusedInOneLineAndNothingIsTouched) {
    const TempFolder folder;
    fs::copy(golden(2), folder / "hall", fs::copy_options::recursive);
    json manifest = json::parse(bytes_of(folder / "hall/manifest.json"));
    manifest["version"] = kMapFormatVersion + 1;
    manifest["crc32"] = "of a way to count that we do not know";
    manifest["files"] = "in a place that we do not know";
    overwrite(folder / "hall/manifest.json", manifest.dump());
    const auto before = content_of(folder.path());
    EXPECT_THAT(error_of([&] { read_map(folder / "hall"); }),
                AllOf(HasSubstr("hall: the map has version 3, but this program reads maps up to 2"),
                      Not(HasSubstr("\n"))));
    EXPECT_EQ(content_of(folder.path()), before);
}

}  // namespace
}  // namespace hybrid_slam
