// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/map_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "map_files.hpp"
#include "map_support.hpp"
#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam {
namespace {

namespace fs = std::filesystem;
using namespace test;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

void expect_same(const Points& found, const Points& expected) {
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
        EXPECT_EQ(found[i], expected[i].cast<float>().cast<double>()) << "point " << i;
    }
}

TEST(MapFolder, GivesBackWhatWasWritten) {
    const TempFolder folder;
    const SlamMap map = room(40);
    store(folder / "hall", map);
    const StoredMap stored = read_map(folder / "hall");

    EXPECT_EQ(stored.version, kMapFormatVersion);
    ASSERT_EQ(stored.keyframes.size(), map.keyframes.size());
    for (std::size_t i = 0; i < map.keyframes.size(); ++i) {
        EXPECT_EQ(stored.keyframes[i].stamp, map.keyframes[i].stamp);
        EXPECT_EQ(stored.keyframes[i].path, map.keyframes[i].path);
        EXPECT_EQ(stored.keyframes[i].local_from_robot.vector(),
                  map.keyframes[i].local_from_robot.vector());
        EXPECT_EQ(stored.keyframes[i].robot_from_laser.vector(),
                  map.keyframes[i].robot_from_laser.vector());
        expect_same(stored.keyframes[i].surface.points, map.keyframes[i].surface.points);
        expect_same(stored.keyframes[i].surface.normals, map.keyframes[i].surface.normals);
        EXPECT_EQ(stored.graph.nodes[i].vector(), map.graph.nodes[i].vector());
        EXPECT_NEAR(stored.trajectory[i].stamp, map.trajectory[i].stamp, 1e-6);
        EXPECT_THAT(stored.trajectory[i].pose, PoseNear(map.trajectory[i].pose, 1e-8, 1e-10));
    }
    ASSERT_EQ(stored.graph.edges.size(), map.graph.edges.size());
    for (std::size_t i = 0; i < map.graph.edges.size(); ++i) {
        EXPECT_EQ(stored.graph.edges[i].from, map.graph.edges[i].from);
        EXPECT_EQ(stored.graph.edges[i].to, map.graph.edges[i].to);
        EXPECT_EQ(stored.graph.edges[i].kind, map.graph.edges[i].kind);
        EXPECT_EQ(stored.graph.edges[i].information, map.graph.edges[i].information);
    }
    EXPECT_THAT(stored.graph.priors, SizeIs(1));
    EXPECT_EQ(stored.graph.fixed, map.graph.fixed);
    const StateGrid grid = to_states(draw_grid(map.keyframes, map.graph));
    EXPECT_EQ(stored.grid.states, grid.states);
    EXPECT_EQ(stored.grid.geometry.origin, grid.geometry.origin);
    ASSERT_THAT(stored.odometry_trajectory, SizeIs(map.odometry_trajectory.size()));
    EXPECT_THAT(stored.odometry_trajectory[3].pose,
                PoseNear(map.odometry_trajectory[3].pose, 1e-8, 1e-10));
    ASSERT_TRUE(stored.pyramid);
    EXPECT_EQ(stored.pyramid->finest(),
              search_pyramid(draw_walls(map.keyframes, map.graph, grid).points).finest());
}

TEST(MapFolder, SameMapGivesSameBytes) {
    const TempFolder folder;
    store(folder / "a", room(40));
    store(folder / "b", room(40));
    EXPECT_EQ(content_of(folder / "a"), content_of(folder / "b"));
    EXPECT_THAT(content_of(folder / "a"), SizeIs(9));
}

TEST(MapFolder, WhatWasReadAndWrittenAgainHasTheSameKeyframes) {
    const TempFolder folder;
    write_keyframes(folder / "a", room(40).keyframes);
    write_keyframes(folder / "b", read_keyframes(folder / "a"));
    EXPECT_EQ(bytes_of(folder / "a"), bytes_of(folder / "b"));
}

TEST(MapFolder, ManifestSaysWhatIsThere) {
    const TempFolder folder;
    const SlamMap map = room(40);
    store(folder / "hall", map);
    json manifest = json::parse(bytes_of(folder / "hall/manifest.json"));
    EXPECT_EQ(manifest["format"], "hybrid_slam map");
    EXPECT_EQ(manifest["version"], 2);
    EXPECT_EQ(manifest["counts"], (json{{"keyframes", 6}, {"edges", 6}, {"scans", 6}}));
    EXPECT_NEAR(manifest["bounds"]["lower"][0].get<double>(), -kHalfLength, 1e-9);
    EXPECT_NEAR(manifest["bounds"]["upper"][1].get<double>(), kHalfWidth, 1e-9);
    EXPECT_THAT(manifest["files"], SizeIs(8));
    for (const auto& [name, said] : manifest["files"].items()) {
        const std::string bytes = bytes_of(folder / "hall" / name);
        EXPECT_EQ(said["bytes"], bytes.size()) << name;
        EXPECT_EQ(said["crc32"], slow_crc(bytes)) << name;
    }
}

TEST(MapFolder, FilesThatLieBesideTheMapAreInTheManifest) {
    const TempFolder folder;
    MapFolderWriter writer(folder / "hall");
    write_map(writer.path(), room(10));
    fs::create_directory(writer.path() / "report");
    overwrite(writer.path() / "report/config.yaml", "slam: {}\n");
    writer.commit();
    EXPECT_EQ(writer.path().filename(), "hall");
    EXPECT_NO_THROW(read_map(folder / "hall"));
    overwrite(folder / "hall/report/config.yaml", "slam: []\n");
    EXPECT_THAT(error_of([&] { read_map(folder / "hall"); }), HasSubstr("report/config.yaml"));
}

TEST(MapFolder, WithoutCommitNothingChanges) {
    const TempFolder folder;
    store(folder / "hall", room(10));
    const auto before = content_of(folder.path());
    {
        MapFolderWriter writer(folder / "hall");
        EXPECT_EQ(writer.path().parent_path(), fs::canonical(folder.path()));
        write_map(writer.path(), room(20));
        EXPECT_NE(content_of(folder.path()), before);
    }
    EXPECT_EQ(content_of(folder.path()), before);
}

TEST(MapFolder, CommitWithoutAMapLeavesTheOldOne) {
    const TempFolder folder;
    store(folder / "hall", room(10));
    const auto before = content_of(folder.path());
    {
        MapFolderWriter writer(folder / "hall");
        EXPECT_THAT(error_of([&] { writer.commit(); }), HasSubstr("no map was written"));
    }
    EXPECT_EQ(content_of(folder.path()), before);
}

TEST(MapFolder, ReplacesTheOldMapWhole) {
    const TempFolder folder;
    {
        MapFolderWriter writer(folder / "hall");
        write_map(writer.path(), room(10));
        overwrite(writer.path() / "old.txt", "of the first");
        writer.commit();
    }
    store(folder / "hall", room(20));
    store(folder / "alone", room(20));
    EXPECT_EQ(content_of(folder / "hall"), content_of(folder / "alone"));
    EXPECT_THAT(std::vector<fs::path>(fs::directory_iterator(folder.path()), {}), SizeIs(2));
}

TEST(MapFolder, IsNotReplacedWhenSomebodyKeepsAFileInIt) {
    const TempFolder folder;
    store(folder / "hall", room(10));
    overwrite(folder / "hall" / "drive.clf", "the only copy of a log");
    EXPECT_THAT(error_of([&] { const MapFolderWriter writer(folder / "hall"); }),
                HasSubstr("drive.clf"));
    EXPECT_TRUE(fs::exists(folder / "hall" / "drive.clf"));
}

TEST(MapFolder, WhatACrashLeavesIsClearedByTheNextWriter) {
    const TempFolder folder;
    store(folder / "hall", room(10));
    const auto before = content_of(folder.path());
    const pid_t child = fork();
    if (child == 0) {
        MapFolderWriter writer(folder / "hall");
        write_map(writer.path(), room(20));
        _exit(0);  // no destructor runs
    }
    ASSERT_EQ(waitpid(child, nullptr, 0), child);
    EXPECT_NE(content_of(folder.path()), before) << "the crash left nothing to be cleared";
    EXPECT_NO_THROW(read_map(folder / "hall"));
    { const MapFolderWriter writer(folder / "hall"); }
    EXPECT_EQ(content_of(folder.path()), before);
}

TEST(MapFolder, LeavesAloneWhatOnlyLooksLikeALeftover) {
    const TempFolder folder;
    for (const char* name : {".hall.part", ".hall.part12x", ".hal.part12", "hall.part12"}) {
        fs::create_directory(folder / name);
    }
    folder.write(".hall.part13", "a file");
    const auto before = content_of(folder.path());
    { const MapFolderWriter writer(folder / "hall"); }
    EXPECT_EQ(content_of(folder.path()), before);
}

TEST(MapFolder, TwoWritersDoNotDisturbEachOther) {
    const TempFolder folder;
    MapFolderWriter first(folder / "hall");
    write_map(first.path(), room(10));
    MapFolderWriter second(folder / "hall");
    EXPECT_NE(first.path(), second.path());
    write_map(second.path(), room(20));
    first.commit();
    EXPECT_THAT(read_map(folder / "hall").keyframes[0].surface.points, SizeIs(10));
    second.commit();
    EXPECT_THAT(read_map(folder / "hall").keyframes[0].surface.points, SizeIs(20));
}

TEST(MapFolder, CreatesParentsAndTakesASlashAtTheEnd) {
    const TempFolder folder;
    store(folder / "site/floor/hall/", room(10));
    EXPECT_NO_THROW(read_map(folder / "site/floor/hall/"));
    fs::create_directory(folder / "empty");
    store(folder / "empty/", room(10));
    EXPECT_NO_THROW(read_map(folder / "empty"));
}

TEST(MapFolder, FollowsALinkToTheFolder) {
    const TempFolder folder;
    store(folder / "hall", room(10));
    fs::create_directory_symlink(folder / "hall", folder / "today");
    store(folder / "today", room(20));
    EXPECT_TRUE(fs::is_symlink(folder / "today"));
    EXPECT_THAT(read_map(folder / "hall").keyframes[0].surface.points, SizeIs(20));
}

TEST(MapFolder, WritesToTheFolderThatWeStandIn) {
    const TempFolder folder;
    const fs::path before = fs::current_path();
    fs::create_directory(folder / "here");
    fs::current_path(folder / "here");
    store(".", room(10));
    EXPECT_NO_THROW(read_map("."));
    store(".", room(20));
    EXPECT_THAT(read_map(".").keyframes[0].surface.points, SizeIs(20));
    EXPECT_EQ(fs::current_path(), fs::canonical(folder / "here"));
    fs::current_path(before);
    EXPECT_THAT(content_of(folder.path()), SizeIs(10));
}

TEST(MapFolder, ReplacesNothingThatIsNoMap) {
    const TempFolder folder;
    folder.write("file", "mine");
    fs::create_directories(folder / "photos/summer");
    fs::create_directory(folder / "web");
    folder.write("web/manifest.json", R"({"name": "an app", "version": 1})");
    fs::create_directory(folder / "torn");
    folder.write("torn/manifest.json", R"({"format": "hybrid_slam map", "ver)");
    const auto before = content_of(folder.path());
    for (const char* name : {"file", "photos", "web", "torn"}) {
        EXPECT_THAT(error_of([&] { const MapFolderWriter writer(folder / name); }),
                    HasSubstr(std::string("/") + name + ": is "));
    }
    error_of([&] { const MapFolderWriter writer(folder / "file/below"); });
    error_of([] { const MapFolderWriter writer(""); });
    error_of([] { const MapFolderWriter writer("/"); });
    EXPECT_EQ(content_of(folder.path()), before);
}

TEST(MapFolder, LooksAgainBeforeItReplaces) {
    const TempFolder folder;
    MapFolderWriter writer(folder / "hall");
    write_map(writer.path(), room(10));
    fs::create_directory(folder / "hall");
    folder.write("hall/thesis.txt", "three years of work");
    EXPECT_THAT(error_of([&] { writer.commit(); }), HasSubstr("not a map"));
    EXPECT_EQ(bytes_of(folder / "hall/thesis.txt"), "three years of work");
}

TEST(MapFolder, ReplacesByTwoRenamesWhereFoldersCannotBeExchanged) {
    const TempFolder folder;
    for (const char* name : {"old", "new"}) {
        fs::create_directory(folder / name);
        overwrite(folder / name / "which", name);
    }
    put_into_place(folder / "new", folder / "old", false);
    EXPECT_THAT(content_of(folder.path()),
                ElementsAre(std::pair("old", "a folder"), std::pair("old/which", "new")));
    // The second rename fails: there is nothing to move.
    EXPECT_THAT(error_of([&] { put_into_place(folder / "gone", folder / "old", false); }),
                HasSubstr("old"));
    EXPECT_THAT(content_of(folder.path()),
                ElementsAre(std::pair("old", "a folder"), std::pair("old/which", "new")));
}

TEST(MapFolder, ACrashBetweenTheTwoRenamesLosesNothing) {
    const TempFolder folder;
    store(folder / "hall", room(10));
    const auto before = content_of(folder.path());
    fs::rename(folder / "hall", side_of(folder / "hall"));
    { const MapFolderWriter writer(folder / "hall"); }
    EXPECT_EQ(content_of(folder.path()), before);
    // After the second one only the old map is left over.
    fs::copy(folder / "hall", side_of(folder / "hall"));
    { const MapFolderWriter writer(folder / "hall"); }
    EXPECT_EQ(content_of(folder.path()), before);
}

TEST(MapFolder, AMapOfABlindLidarCanBeStored) {
    const TempFolder folder;
    SlamMap map = room(1);
    for (Keyframe& keyframe : map.keyframes) {
        keyframe.surface = {};
    }
    map.odometry_trajectory.clear();
    store(folder / "dark", map);
    const StoredMap stored = read_map(folder / "dark");
    EXPECT_THAT(stored.keyframes, SizeIs(6));
    EXPECT_THAT(stored.odometry_trajectory, SizeIs(0));
    EXPECT_FALSE(stored.pyramid);
    EXPECT_FALSE(fs::exists(folder / "dark/pyramid.bin"));
}

}  // namespace
}  // namespace hybrid_slam
