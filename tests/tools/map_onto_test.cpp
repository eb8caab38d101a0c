// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <set>

#include "hybrid_slam/backend/map_folder.hpp"
#include "hybrid_slam/core/metrics.hpp"
#include "localized_room.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;

std::set<std::string> names_in(const std::filesystem::path& folder) {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        names.insert(entry.path().filename().string());
    }
    return names;
}

TEST(MapOnto, MakesOneMapOfBoth) {
    const TempFolder folder;
    map_room(folder);
    const std::string before = bytes_of(folder / "room/manifest.json");
    const Outcome result = run_well(folder, "map second.clf --onto room/ --out both");
    EXPECT_THAT(result.out, HasSubstr("accepted of"));
    EXPECT_THAT(result.out, HasSubstr("map        both"));
    EXPECT_EQ(bytes_of(folder / "room/manifest.json"), before) << "it stays";
    EXPECT_FALSE(std::filesystem::exists(folder / "both_unanchored"));

    const Json of_room = run_well(folder, "info room --json").json();
    const Json of_both = run_well(folder, "info both --json").json();
    const double second = length_of(read_tum(folder / "second.truth.tum"));
    EXPECT_NEAR(of_both["path_length_m"].get<double>() - of_room["path_length_m"].get<double>(),
                second, 0.1)
        << "nobody drove from the end of the one to the start of the other";
    EXPECT_NEAR(
        of_both["duration_s"].get<double>(),
        of_room["duration_s"].get<double>() + read_tum(folder / "second.truth.tum").back().stamp,
        0.5);

    const StoredMap room = read_map(folder / "room");
    const StoredMap both = read_map(folder / "both");
    const Json summary = Json::parse(bytes_of(folder / "both/summary.json"));
    const Json& onto = summary["onto"];
    EXPECT_EQ(onto["map"], "room");
    EXPECT_EQ(onto["verdict"], "anchored");
    EXPECT_EQ(onto["stored_keyframes"], room.keyframes.size());
    EXPECT_EQ(summary["keyframes"], both.keyframes.size());
    EXPECT_GT(both.keyframes.size(), room.keyframes.size() + 20);
    const Json& anchors = onto["anchors"];
    EXPECT_EQ(anchors["tried"].get<std::size_t>() + anchors["outside"].get<std::size_t>(),
              both.keyframes.size() - room.keyframes.size());
    EXPECT_EQ(anchors["tried"], anchors["accepted"].get<int>() +
                                    anchors["contradicted"].get<int>() +
                                    anchors["disagreeing"].get<int>());
    EXPECT_GT(anchors["accepted"], 20);
    EXPECT_EQ(read_tum(folder / "both/odometry.tum").size(), both.trajectory.size());

    // The second drive in the frame that the first one began, and so the truth of both.
    const Trajectory truth = read_tum(folder / "second.truth.tum");
    const Pose2d world_from_map = read_tum(folder / "room.truth.tum").front().pose;
    ASSERT_EQ(both.trajectory.size(), room.trajectory.size() + truth.size());
    for (std::size_t i = 0; i < truth.size(); ++i) {
        const Pose2d found = world_from_map * both.trajectory[room.trajectory.size() + i].pose;
        ASSERT_LT((found.translation - truth[i].pose.translation).norm(), 0.05) << i;
    }
}

TEST(MapOnto, GivesTheSameBytesEachTime) {
    const TempFolder folder;
    map_room(folder);
    run_well(folder, "map second.clf --onto room --out a --quiet");
    run_well(folder, "map second.clf --onto room --out b --quiet --json");
    const std::set<std::string> names = names_in(folder / "a");
    ASSERT_EQ(names, names_in(folder / "b"));
    for (const std::string& name : names) {
        if (name != "summary.json" && name != "manifest.json") {
            EXPECT_TRUE(same_bytes(folder / ("a/" + name), folder / ("b/" + name))) << name;
        }
    }
    EXPECT_EQ(Json::parse(bytes_of(folder / "a/summary.json"))["onto"],
              Json::parse(bytes_of(folder / "b/summary.json"))["onto"]);
}

TEST(MapOnto, AMapMayGrowInItsPlace) {
    const TempFolder folder;
    map_room(folder);
    const std::size_t before = read_map(folder / "room").keyframes.size();
    run_well(folder, "map second.clf --onto room --out room --quiet");
    const std::size_t once = read_map(folder / "room").keyframes.size();
    EXPECT_GT(once, before);
    run_well(folder, "map second.clf --onto room --out room --quiet");
    EXPECT_EQ(read_map(folder / "room").keyframes.size(), once + (once - before));
}

TEST(MapOnto, ADriveElsewhereKeepsItsOwnMapAndTheStoredOneStays) {
    const TempFolder folder;
    simulate_room(folder);
    simulate_elsewhere(folder, "other");
    run_well(folder, "map room.clf --out room --quiet");
    run_well(folder, "map other.clf --out other --quiet");
    const std::string before = bytes_of(folder / "room/manifest.json");
    for (const char* out : {"both", "room"}) {
        const Outcome result =
            run(folder, std::string("map other.clf --onto room --quiet --out ") + out);
        const std::string own = std::string(out) + "_unanchored";
        EXPECT_EQ(result.code, 6);
        EXPECT_THAT(result.err, HasSubstr("other.clf: not anchored to room: "));
        EXPECT_THAT(result.err, HasSubstr("its own map is in " + own + "\n"));
        EXPECT_THAT(result.out, HasSubstr("map        " + own));
        EXPECT_TRUE(same_bytes(folder / (own + "/keyframes.bin"), folder / "other/keyframes.bin"));
        EXPECT_TRUE(same_bytes(folder / (own + "/map.pgm"), folder / "other/map.pgm"));
    }
    EXPECT_FALSE(std::filesystem::exists(folder / "both"));
    EXPECT_EQ(bytes_of(folder / "room/manifest.json"), before);
}

TEST(MapOnto, LookAlikePlacesHaveACodeOfTheirOwn) {
    const TempFolder folder;
    folder.write("square.yaml", R"(name: square
walls:
  - {points: [[0, 0], [6, 0], [6, 6], [0, 6]], closed: true}
path: [[1.5, 1.5], [4.5, 1.5], [4.5, 4.5], [1.5, 4.5], [1.5, 1.5]]
simulator: {speed: 1.0, scan_rate: 5, angle_increment: 0.017453292519943295}
)");
    run_well(folder, "simulate square.yaml --out square.clf --quiet");
    run_well(folder, "map square.clf --out square --quiet");
    const Outcome result = run(folder, "map square.clf --onto square --out both --json");
    EXPECT_EQ(result.code, 5);
    EXPECT_THAT(result.err, HasSubstr("look alike"));
    EXPECT_EQ(result.json()["onto"]["verdict"], "ambiguous");
    EXPECT_EQ(result.json()["onto"]["anchors"]["accepted"], 0);
}

TEST(MapOnto, WhatIsNoMapIsToldBeforeTheWork) {
    const TempFolder folder;
    simulate_room(folder);
    const std::set<std::string> before = names_in(folder.path());
    const Outcome result = run(folder, "map room.clf --onto nowhere --out both");
    EXPECT_EQ(result.code, 1);
    EXPECT_EQ(result.err, "hybrid-slam: nowhere: there is no such folder\n");
    folder.write("theirs.yaml", "image: theirs.pgm\n");
    EXPECT_THAT(run(folder, "map room.clf --onto theirs.yaml --out both").err,
                HasSubstr("theirs.yaml: this needs a map folder made by hybrid-slam; a map_server "
                          "map serves relocalize and localize only\n"));
    std::filesystem::remove(folder / "theirs.yaml");
    std::set<std::string> after = names_in(folder.path());
    after.erase("stdout.txt");
    after.erase("stderr.txt");
    for (const std::string& name : after) {
        EXPECT_TRUE(before.count(name) == 1) << name;
    }
    std::filesystem::create_directory(folder / "both_unanchored");
    folder.write("both_unanchored/letter.txt", "Dear Anna");
    run_well(folder, "map room.clf --out room --quiet");
    const Outcome held = run(folder, "map room.clf --onto room --out both");
    EXPECT_EQ(held.code, 1);
    EXPECT_THAT(held.err, HasSubstr("both_unanchored"));
}

}  // namespace
}  // namespace hybrid_slam::test
