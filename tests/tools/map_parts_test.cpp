// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>

#include "hybrid_slam/backend/g2o.hpp"
#include "hybrid_slam/backend/map_folder.hpp"
#include "hybrid_slam/core/trajectory.hpp"
#include "running.hpp"

// The commands `export` and `crop`.
namespace hybrid_slam::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

namespace fs = std::filesystem;

constexpr const char* kGolden = HYBRID_SLAM_SOURCE_DIR "/tests/backend/data/map_v2";

/// The golden map as "hall".
void copy_map(const TempFolder& folder) {
    fs::copy(kGolden, folder / "hall", fs::copy_options::recursive);
}

std::string refusal(const TempFolder& folder, const std::string& arguments) {
    const Outcome outcome = run(folder, arguments);
    EXPECT_EQ(outcome.code, 1) << arguments;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    return outcome.err;
}

TEST(Export, WritesEachFormatBySuffixOrName) {
    const TempFolder folder;
    copy_map(folder);
    const StoredMap map = read_map(folder / "hall");
    EXPECT_THAT(run_well(folder, "export hall --out a.yaml").out, HasSubstr("a.yaml, a.pgm"));
    EXPECT_EQ(read_map_server(folder / "a.yaml").states, map.grid.states);
    run_well(folder, "export hall --out a.ply");
    EXPECT_TRUE(same_bytes(folder / "a.ply", folder / "hall/points.ply"));
    const Json json = run_well(folder, "export hall --out cloud --format pcd --json").json();
    EXPECT_EQ(json["format"], "pcd");
    EXPECT_EQ(json["files"], Json::array({"cloud"}));
    EXPECT_THAT(bytes_of(folder / "cloud"),
                AllOf(StartsWith("# .PCD v0.7"),
                      HasSubstr("\nPOINTS " + std::to_string(json["records"].get<int>()))));
    run_well(folder, "export hall --out a.g2o");
    EXPECT_EQ(read_g2o(folder / "a.g2o").graph.edges.size(), map.graph.edges.size());
    EXPECT_THAT(run_well(folder, "export hall --out a.tum").out, HasSubstr("156 poses"));
    EXPECT_EQ(read_tum(folder / "a.tum").size(), map.trajectory.size());
}

TEST(Export, OfAMapThatSomebodyElseMade) {
    const TempFolder folder;
    copy_map(folder);
    run_well(folder, "export hall --out theirs.yaml");
    EXPECT_THAT(run_well(folder, "export theirs.yaml --out walls.ply").out, HasSubstr("points"));
    run_well(folder, "export theirs.yaml --out again.yaml");
    EXPECT_TRUE(same_bytes(folder / "again.pgm", folder / "theirs.pgm"));
    EXPECT_THAT(refusal(folder, "export theirs.yaml --out a.g2o"), HasSubstr("needs a map folder"));
    EXPECT_THAT(refusal(folder, "export theirs.yaml --out a.tum"), HasSubstr("needs a map folder"));
}

TEST(Export, ReplacesOnlyItsOwnKind) {
    const TempFolder folder;
    copy_map(folder);
    for (const std::string name : {"a.yaml", "a.ply", "a.pcd", "a.g2o", "a.tum"}) {
        run_well(folder, "export hall --out " + name);
        run_well(folder, "export hall --out " + name);
        folder.write(name, "three years of work\n");
        EXPECT_THAT(refusal(folder, "export hall --out " + name),
                    AllOf(HasSubstr(name), HasSubstr("not replaced")));
        EXPECT_EQ(bytes_of(folder / name), "three years of work\n");
    }
    folder.write("b.pgm", "my drawing");
    EXPECT_THAT(refusal(folder, "export hall --out b.yaml"), HasSubstr("b.pgm"));
    EXPECT_FALSE(fs::exists(folder / "b.yaml"));
    fs::create_directory(folder / "c.ply");
    refusal(folder, "export hall --out c.ply");
}

TEST(Export, LeavesTheFilesOfAMapAlone) {
    const TempFolder folder;
    copy_map(folder);
    EXPECT_THAT(refusal(folder, "export hall --out hall/map.yaml"), HasSubstr("another --out"));
    refusal(folder, "export hall --out hall/new.ply");
    run_well(folder, "info hall");
    EXPECT_FALSE(fs::exists(folder / "hall/new.ply"));
}

TEST(Export, WrongUsageAndMissingMaps) {
    const TempFolder folder;
    copy_map(folder);
    EXPECT_EQ(run(folder, "export hall").code, 2);
    EXPECT_EQ(run(folder, "export hall --out a --format stl").code, 2);
    EXPECT_THAT(refusal(folder, "export hall --out a.stl"), HasSubstr("--format"));
    EXPECT_THAT(refusal(folder, "export nowhere --out a.ply"), HasSubstr("nowhere"));
    fs::resize_file(folder / "hall/pyramid.bin", 100);
    EXPECT_THAT(refusal(folder, "export hall --out a.ply"), HasSubstr("pyramid.bin"));
    EXPECT_FALSE(fs::exists(folder / "a.ply"));
}

TEST(Crop, MakesAMapOfAPart) {
    const TempFolder folder;
    copy_map(folder);
    const StoredMap whole = read_map(folder / "hall");
    const Json json = run_well(folder, "crop hall --box=-1,-1,1.2,3 --out west --json").json();
    const StoredMap west = read_map(folder / "west");
    EXPECT_EQ(json["keyframes"], west.keyframes.size());
    EXPECT_EQ(json["cropped_from"], "hall");
    EXPECT_EQ(json["log"], "room.clf");
    EXPECT_GT(west.keyframes.size(), 3U);
    EXPECT_LT(west.keyframes.size(), whole.keyframes.size());
    EXPECT_EQ(west.grid.geometry.resolution, whole.grid.geometry.resolution);
    EXPECT_LT(west.grid.geometry.width, whole.grid.geometry.width);
    for (const Pose2d& node : west.graph.nodes) {
        EXPECT_LT(node.x(), 1.2);
    }
    EXPECT_TRUE(west.pyramid);
    EXPECT_TRUE(same_bytes(folder / "west/config.yaml", folder / "hall/config.yaml"));
    EXPECT_THAT(run_well(folder, "info west").out, HasSubstr("from room.clf"));
    const Json rest =
        run_well(folder, "crop hall --box 1.2,3,-1,-1 --outside --out east --json").json();
    EXPECT_EQ(json["keyframes"].get<std::size_t>() + rest["keyframes"].get<std::size_t>(),
              whole.keyframes.size());
}

TEST(Crop, TakesAPolygonWithNegativeCorners) {
    const TempFolder folder;
    copy_map(folder);
    EXPECT_THAT(run_well(folder, "crop hall --polygon -1,-1 1.2,-1 1.2,3 -1,3 --out part").out,
                AllOf(HasSubstr("of 19 keyframes"), HasSubstr("map        part")));
    run_well(folder, "crop hall --box=-1,-1,1.2,3 --out box");
    EXPECT_TRUE(same_bytes(folder / "part/keyframes.bin", folder / "box/keyframes.bin"));
}

TEST(Crop, RefusesWhatWouldLoseSomething) {
    const TempFolder folder;
    copy_map(folder);
    EXPECT_THAT(refusal(folder, "crop hall --box 90,90,91,91 --out none"),
                HasSubstr("nothing would be left"));
    EXPECT_FALSE(fs::exists(folder / "none"));
    EXPECT_THAT(refusal(folder, "crop hall --box 0,0,1,1 --out hall"), HasSubstr("map itself"));
    fs::create_directory(folder / "photos");
    folder.write("photos/me.jpg", "a picture");
    EXPECT_THAT(refusal(folder, "crop hall --box=-1,-1,1.2,3 --out photos"),
                HasSubstr("not a map"));
    EXPECT_THAT(refusal(folder, "crop nowhere --box 0,0,1,1 --out x"), HasSubstr("nowhere"));
    EXPECT_THAT(refusal(folder, "crop hall/map.yaml --box 0,0,1,1 --out x"),
                HasSubstr("hall/map.yaml: this needs a map folder made by hybrid-slam"));
    folder.write("drive.clf", "FLASER 0 0 0 0 0 0 0 0 x 0\n");
    EXPECT_THAT(refusal(folder, "crop drive.clf --box 0,0,1,1 --out x"),
                HasSubstr("drive.clf: is a file, not a map"));
    EXPECT_EQ(bytes_of(folder / "photos/me.jpg"), "a picture");
}

TEST(Crop, WrongUsageIsTwo) {
    const TempFolder folder;
    copy_map(folder);
    for (const std::string arguments :
         {"crop hall --out x", "crop hall --box 1,2,3 --out x", "crop hall --box 1,2,nan,3 --out x",
          "crop hall --box 0,0,1,1", "crop hall --polygon 0,0 1,1 --out x",
          "crop hall --polygon 0,0 1,1 2 --out x", "crop hall --polygon 0,0 1,1 2,x --out x",
          "crop hall --box 0,0,1,1 --polygon 0,0 1,1 2,0 --out x"}) {
        EXPECT_EQ(run(folder, arguments).code, 2) << arguments;
    }
    EXPECT_FALSE(fs::exists(folder / "x"));
}

}  // namespace
}  // namespace hybrid_slam::test
