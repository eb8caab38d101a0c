// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <cmath>

#include "hybrid_slam/core/trajectory.hpp"
#include "hybrid_slam/recording/recording.hpp"
#include "running.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;

/// A quick drive through the room, the lidar alone: the folder sim1.
void record_room(const TempFolder& folder, const std::string& more = "") {
    write_room(folder);
    run_well(folder,
             "simulate room.yaml --out sim1 --no-camera --quiet --set speed=1 --set distance=15 " +
                 more);
}

TEST(Drive, ASimulatedRecordingIsMappedLikeALog) {
    const TempFolder folder;
    record_room(folder);
    const Json summary = run_well(folder, "map sim1/ --out hall --json").json();
    EXPECT_EQ(summary["log"], "sim1");
    EXPECT_EQ(summary["warnings"].size(), 0U);
    const Trajectory truth = read_tum(folder / "sim1" / "truth.tum");
    EXPECT_EQ(summary["scans"], truth.size());
    const Json error =
        run_well(folder, "evaluate hall/trajectory.tum --truth sim1/truth.tum --align first --json")
            .json();
    EXPECT_LT(error["ate_rmse_m"], 0.03);
    EXPECT_LT(error["heading_rmse_deg"], 0.5);
}

TEST(Drive, SameSeedSameRecordingAndMap) {
    const TempFolder folder;
    record_room(folder);
    std::filesystem::rename(folder / "sim1", folder / "first");
    record_room(folder);
    for (const char* file : {"manifest.json", "robot.yaml", "lidar.rec", "truth.tum"}) {
        EXPECT_TRUE(same_bytes(folder / "first" / file, folder / "sim1" / file)) << file;
    }
    run_well(folder, "map first --out a -q");
    run_well(folder, "map sim1 --out b -q");
    EXPECT_TRUE(same_bytes(folder / "a" / "keyframes.bin", folder / "b" / "keyframes.bin"));
    EXPECT_TRUE(same_bytes(folder / "a" / "trajectory.tum", folder / "b" / "trajectory.tum"));
}

TEST(Drive, ComparesARecordingWithItsOwnTruth) {
    const TempFolder folder;
    record_room(folder);
    const Json json = run_well(folder, "compare sim1 --json").json();
    EXPECT_EQ(json["yardstick"], "truth.tum");
    EXPECT_EQ(json["variants"].size(), 3U);
    EXPECT_EQ(json["variants"][2]["error"]["alignment"], "first");
    EXPECT_LT(json["variants"][2]["error"]["ate_rmse_m"], 0.03);
    EXPECT_TRUE(std::filesystem::exists(folder / "sim1_compare" / "compare.png"));
    std::filesystem::remove(folder / "sim1" / "truth.tum");
    const Json without = run_well(folder, "compare sim1 --json").json();
    EXPECT_TRUE(without["yardstick"].is_null());
    EXPECT_EQ(without["held_against"], "seeded ICP + graph");
    EXPECT_EQ(without["variants"][0]["error"]["metric"], "difference");
    EXPECT_TRUE(without["variants"][2]["error"].is_null());
    EXPECT_THAT(bytes_of(folder / "sim1_compare" / "compare.txt"), HasSubstr("there is no truth"));
}

TEST(Drive, ImagesAreRecordedUnlessTheyAreLeftOut) {
    const TempFolder folder;
    write_room(folder);
    folder.write("small.yaml",
                 "camera:\n  model: {width: 160, height: 120, fx: 180, fy: 180, cx: 80, cy: 60}\n");
    run_well(folder, "simulate room.yaml --robot small.yaml --out sim1 -q --set distance=1");
    RecordingReader reader(folder / "sim1");
    std::size_t images = 0;
    while (const auto event = reader.next()) {
        images += std::holds_alternative<CameraFrame>(*event) ? 1 : 0;
    }
    EXPECT_GT(images, 60U);
    EXPECT_EQ(reader.robot().camera.model.width, 160);
}

TEST(Drive, WhatIsThereIsNotOverwritten) {
    const TempFolder folder;
    record_room(folder);
    const Outcome again = run(folder, "simulate room.yaml --out sim1 --no-camera");
    EXPECT_EQ(again.code, 1);
    EXPECT_THAT(again.err, HasSubstr("sim1"));
}

TEST(Drive, AnotherRobotCanBeTakenThanTheOneRecorded) {
    const TempFolder folder;
    record_room(folder);
    folder.write("turned.yaml", "lidar: {x: 1.3, yaw_deg: 90}\n");
    run_well(folder, "map sim1 --out as_recorded -q");
    run_well(folder, "map sim1 --robot turned.yaml --out turned -q");
    const Trajectory straight = read_tum(folder / "as_recorded" / "trajectory.tum");
    const Trajectory turned = read_tum(folder / "turned" / "trajectory.tum");
    ASSERT_EQ(straight.size(), turned.size());
    const Point2 ahead = straight[straight.size() / 8].pose.translation;
    const Point2 aside = turned[turned.size() / 8].pose.translation;
    EXPECT_GT(ahead.norm(), 0.5);
    EXPECT_LT(std::abs(ahead.dot(aside)), 0.3 * ahead.squaredNorm()) << "a quarter turn apart";
    run_well(folder, "simulate room.yaml --out room.clf -q");
    EXPECT_EQ(run(folder, "map room.clf --robot turned.yaml --out m").code, 1);
}

TEST(Drive, UsageIsExplained) {
    const TempFolder folder;
    write_room(folder);
    EXPECT_EQ(run(folder, "simulate room.yaml").code, 2);
    EXPECT_EQ(run(folder, "map --out m").code, 2);
    EXPECT_EQ(run(folder, "map x.clf --live --out m").code, 2);
    EXPECT_EQ(run(folder, "map x.clf --lidar /dev/null --out m").code, 2);
    EXPECT_EQ(run(folder, "simulate room.yaml --out x.clf --path loop").code, 2);
    const Outcome no_path = run(folder, "simulate room.yaml --out s --path nowhere");
    EXPECT_EQ(no_path.code, 1);
    EXPECT_THAT(no_path.err, HasSubstr("no path 'nowhere'"));
    std::filesystem::create_directory(folder / "empty");
    EXPECT_THAT(run(folder, "map empty --out m").err, HasSubstr("empty: is a folder, but no"));
}

/// The whole live path: a simulated scanner speaks through a pseudo-terminal, `map --live` listens
/// until it is interrupted.
TEST(Drive, IsMappedLiveThroughASerialLine) {
    const TempFolder folder;
    write_room(folder);
    const std::string program = "'" HYBRID_SLAM_PROGRAM "' ";
    const std::string serve =
        program + "simulate room.yaml --serial scanner --set speed=1.5 --set distance=6 -q >&2 & ";
    const std::string map = "timeout --foreground -s INT 8 " + program +
                            "map --live --lidar scanner --no-camera --out hall --json";
    const Outcome result = run(folder, "--version >&2; " + serve + map);
    EXPECT_THAT(result.err, HasSubstr("lidar: streaming"));
    const Json summary = result.json();
    EXPECT_GT(summary["scans"], 50U);
    EXPECT_EQ(summary["input"]["missed_scans"], 0U);
    EXPECT_TRUE(std::filesystem::exists(folder / "hall" / "map.png"));
}

}  // namespace
}  // namespace hybrid_slam::test
