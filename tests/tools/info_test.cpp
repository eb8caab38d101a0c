// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "drives.hpp"
#include "running.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// `info` of such a drive, as JSON; checks that exit code and verdict agree.
Json info_of(const TempFolder& folder, const Drive& drive) {
    record_drive(folder / "drive", drive);
    const Outcome outcome = run(folder, "info drive --json --no-picture");
    EXPECT_THAT(outcome.code, ::testing::AnyOf(0, 4)) << outcome.err;
    Json json = outcome.json();
    EXPECT_EQ(outcome.code == 0, json["fit"].get<bool>());
    EXPECT_EQ(json["fit"].get<bool>(), json["obstacles"].empty());
    std::filesystem::remove_all(folder / "drive");
    return json;
}

std::string only_obstacle(const Json& json) {
    EXPECT_EQ(json["obstacles"].size(), 1U) << json["obstacles"];
    return json["obstacles"].empty() ? "" : json["obstacles"][0].get<std::string>();
}

TEST(Info, TellsWhatIsInAGoodRecording) {
    const TempFolder folder;
    Drive drive;
    drive.images = 30.0;
    record_drive(folder / "drive", drive);
    const Outcome outcome = run_well(folder, "info drive/");
    EXPECT_THAT(outcome.out, HasSubstr("lidar      50 scans, 12.5 Hz"));
    EXPECT_THAT(outcome.out, HasSubstr("no gap"));
    EXPECT_THAT(outcome.out, HasSubstr("truck 3; lidar at x 1.30"));
    EXPECT_THAT(outcome.out, HasSubstr("camera     120 images, 30.0 Hz, 64 x 48 pixels"));
    EXPECT_THAT(outcome.out, HasSubstr("losses     none"));
    EXPECT_THAT(outcome.out, HasSubstr("verdict    fit for mapping"));
    EXPECT_THAT(outcome.out, Not(HasSubstr("warning")));
    EXPECT_TRUE(std::filesystem::exists(folder / "drive/info.png"));
    EXPECT_EQ(outcome.err, "");
    run_well(folder, "info drive");  // the picture is no stranger to it
}

TEST(Info, JsonHasTheFigures) {
    const TempFolder folder;
    Drive drive;
    drive.images = 10.0;
    const Json json = info_of(folder, drive);
    EXPECT_EQ(json["kind"], "recording");
    EXPECT_EQ(json["scans"]["count"], 50);
    EXPECT_NEAR(json["scans"]["rate_hz"], 12.5, 0.01);
    EXPECT_EQ(json["images"]["count"], 40);
    EXPECT_EQ(json["images"]["width"], 64);
    EXPECT_EQ(json["counts"]["scans"], 50);
    EXPECT_NEAR(json["duration_s"], 3.92, 0.01);
    EXPECT_EQ(json["share_of_returns"], 1.0);
    EXPECT_TRUE(json["moved"].get<bool>());
    EXPECT_TRUE(json["closed"].get<bool>());
    EXPECT_EQ(json["picture"], "");
    EXPECT_EQ(json["warnings"], Json::array());
}

TEST(Info, ACutRecordingMissesWhatItsManifestCounts) {
    const TempFolder folder;
    record_drive(folder / "drive", {});
    const auto lidar = folder / "drive" / "lidar.rec";
    std::filesystem::resize_file(lidar, std::filesystem::file_size(lidar) * 9 / 10);
    EXPECT_THAT(run(folder, "info drive").out,
                HasSubstr("pieces of the lidar's bytes are missing"));
}

TEST(Info, StandingStillIsNotFit) {
    const TempFolder folder;
    Drive drive;
    drive.speed = 0.0;
    EXPECT_THAT(only_obstacle(info_of(folder, drive)), HasSubstr("never moved"));
}

TEST(Info, LongGapIsNotFitAndSaysWhere) {
    const TempFolder folder;
    Drive drive;
    drive.pause_at = 1.99;
    drive.pause = 1.2;
    const Json json = info_of(folder, drive);
    EXPECT_THAT(json["obstacles"][0], HasSubstr("no scan for 1.28 s, 1.9 s after the start"));
    EXPECT_EQ(json["scans"]["gap_count"], 1);
    EXPECT_NEAR(json["scans"]["gaps"][0]["seconds"], 1.28, 0.02);
}

TEST(Info, ShortGapIsToldButFit) {
    const TempFolder folder;
    Drive drive;
    drive.seconds = 20.0;
    drive.speed = 0.2;
    drive.pause_at = 5.03;
    drive.pause = 0.5;
    const Json json = info_of(folder, drive);
    EXPECT_TRUE(json["fit"].get<bool>()) << json["obstacles"];
    EXPECT_EQ(json["scans"]["gap_count"], 1);
    EXPECT_NEAR(json["scans"]["longest_gap_s"], 0.64, 0.02);
}

TEST(Info, TooSlowIsNotFit) {
    const TempFolder folder;
    Drive drive;
    drive.rate = 25.0 / 6.0;
    drive.seconds = 5.0;
    EXPECT_THAT(only_obstacle(info_of(folder, drive)), HasSubstr("4.2 scans a second"));
}

TEST(Info, LostScansAreNotFit) {
    const TempFolder folder;
    Drive drive;
    drive.lose_every = 5;
    const Json json = info_of(folder, drive);
    EXPECT_THAT(only_obstacle(json), HasSubstr("20 % of the scans are lost"));
    EXPECT_EQ(json["counts"]["missed_scans"], 10);
}

TEST(Info, NothingInSightIsNotFit) {
    const TempFolder folder;
    Drive drive;
    drive.returns = false;
    const Json json = info_of(folder, drive);
    EXPECT_THAT(json["obstacles"][0], HasSubstr("too few beams return: 0 %"));
    EXPECT_EQ(json["share_of_returns"], 0.0);
}

TEST(Info, StandbyIsNamedAsTheReason) {
    const TempFolder folder;
    Drive drive;
    drive.standby_word = kS300Standby;
    EXPECT_THAT(only_obstacle(info_of(folder, drive)), HasSubstr("stood by"));
}

TEST(Info, BytesWithoutTelegramsNameTheBaudRate) {
    const TempFolder folder;
    {
        RecordingWriter writer(folder / "drive", {});
        writer.push(LidarBytes{1.0, std::vector<std::uint8_t>(5000, 0x55)});
    }
    const Outcome outcome = run(folder, "info drive");
    EXPECT_EQ(outcome.code, 4);
    EXPECT_THAT(outcome.out, HasSubstr("verdict    not fit: "));
    EXPECT_THAT(outcome.out, HasSubstr("baud rate"));
}

TEST(Info, EmptyRecordingIsNotFit) {
    const TempFolder folder;
    { RecordingWriter(folder / "drive", {}); }
    const Outcome outcome = run(folder, "info drive");
    EXPECT_EQ(outcome.code, 4);
    EXPECT_THAT(outcome.out, HasSubstr("the lidar sent nothing"));
    EXPECT_FALSE(std::filesystem::exists(folder / "drive/info.png"));
}

TEST(Info, CrashIsAWarning) {
    const TempFolder folder;
    record_drive(folder / "drive", {});
    const auto file = folder / "drive/lidar.rec";
    std::filesystem::resize_file(file, std::filesystem::file_size(file) - 100);
    std::filesystem::remove(folder / "drive/manifest.json");
    const Outcome outcome = run_well(folder, "info drive");
    EXPECT_THAT(outcome.out, HasSubstr("warning    the recording was never closed"));
    EXPECT_THAT(outcome.out, HasSubstr("bytes torn off at the end"));
    EXPECT_THAT(outcome.out, HasSubstr("49 scans"));
}

TEST(Info, DroppedImagesAreAWarning) {
    const TempFolder folder;
    Drive drive;
    drive.images = 5.0;
    RecordingOptions options;
    options.keep_free = 1e18;
    record_drive(folder / "drive", drive, options);
    const Outcome outcome = run_well(folder, "info drive");
    EXPECT_THAT(outcome.out, HasSubstr("20 images dropped by the recorder (0 because the disk was "
                                       "too slow, 20 because it was full)"));
    EXPECT_THAT(outcome.out, HasSubstr("no images although the robot has a camera"));
}

TEST(Info, PictureGoesWhereItIsAskedFor) {
    const TempFolder folder;
    record_drive(folder / "drive", {});
    const Outcome outcome = run_well(folder, "info drive --picture strip.png");
    EXPECT_THAT(outcome.out, HasSubstr("picture    strip.png"));
    EXPECT_THAT(bytes_of(folder / "strip.png"), HasSubstr("PNG"));
    EXPECT_FALSE(std::filesystem::exists(folder / "drive/info.png"));
    EXPECT_EQ(run(folder, "info drive --picture a.png --no-picture").code, 2);
    EXPECT_EQ(run(folder, "info drive --picture no/such/folder.png").code, 1);
}

TEST(Info, OfAMap) {
    const TempFolder folder;
    record_drive(folder / "drive", {});
    run_well(folder, "map drive --out hall --quiet");
    const Outcome outcome = run_well(folder, "info hall");
    EXPECT_THAT(outcome.out, HasSubstr("map        version 2, whole"));
    EXPECT_THAT(outcome.out, HasSubstr("Z from drive\n"));
    EXPECT_THAT(outcome.out, HasSubstr("50 scans in 4 s, "));
    EXPECT_THAT(outcome.out, HasSubstr("search     ready"));
    EXPECT_THAT(outcome.out, HasSubstr("\n           keyframes.bin "));
    const Json json = run_well(folder, "info hall --json").json();
    EXPECT_EQ(json["kind"], "map");
    EXPECT_EQ(json["scans"], 50);
    EXPECT_NEAR(json["path_length_m"], 1.96, 0.1);
    EXPECT_GT(json["free_m2"], 50.0);
    EXPECT_LT(json["free_m2"], 112.0);
    EXPECT_GT(json["occupied_m2"], 0.5);
    EXPECT_LT(json["occupied_m2"], 8.0);
    EXPECT_EQ(json["from"], "drive");
    EXPECT_EQ(json["pyramid"], true);
    EXPECT_EQ(json["file_bytes"].size(), json["files"]);
    EXPECT_EQ(json["file_bytes"]["keyframes.bin"],
              std::filesystem::file_size(folder / "hall/keyframes.bin"));
}

TEST(Info, PicturesOfAMapAreNoDataOfIt) {
    const TempFolder folder;
    record_drive(folder / "drive", {});
    run_well(folder, "map drive --out hall --quiet");
    const std::string made = run_well(folder, "info hall --json").json()["made"];
    std::filesystem::remove(folder / "hall/map.png");
    folder.write("hall/graph.png", "drawn anew");
    const Json json = run_well(folder, "info hall --json").json();
    EXPECT_EQ(json["made"], made);
    EXPECT_EQ(json["file_bytes"].count("map.png"), 0U);
    EXPECT_EQ(json["file_bytes"]["graph.png"], 10);
    run_well(folder, "map drive --out hall --quiet");  // they are ours all the same
    EXPECT_GT(std::filesystem::file_size(folder / "hall/graph.png"), 1000U);
}

TEST(Info, OfAMapThatAnEarlierVersionWrote) {
    const TempFolder folder;
    const std::string golden = HYBRID_SLAM_SOURCE_DIR "/tests/backend/data/map_v1";
    const Outcome outcome = run_well(folder, "info '" + golden + "'");
    EXPECT_THAT(outcome.out, HasSubstr("map        version 1, whole"));
    EXPECT_THAT(outcome.out, HasSubstr("graph      19 keyframes, 22 edges, 4 loop closures"));
    EXPECT_THAT(outcome.out, HasSubstr("search     its pyramid is built each time"));
}

TEST(Info, OfAMapOfMapServer) {
    const TempFolder folder;
    folder.write("theirs.pgm",
                 "P5 4 2 255\n" + std::string(5, '\xFE') + "\xCD" + std::string(2, '\0'));
    folder.write("theirs.yaml",
                 "image: theirs.pgm\nresolution: 0.5\norigin: [-1, 2, 0.5]\nnegate: 0\n"
                 "occupied_thresh: 0.65\nfree_thresh: 0.196\n");
    EXPECT_THAT(run_well(folder, "info theirs.yaml").out,
                HasSubstr("size       2.0 m x 1.0 m in cells of 50 cm\n"
                          "origin     x -1.00 m, y 2.00 m, yaw 28.6 deg\n"));
    const Json json = run_well(folder, "info theirs.yaml --json").json();
    EXPECT_EQ(json["kind"], "map_server");
    EXPECT_EQ(json["free_m2"], 1.25);
    EXPECT_EQ(json["unknown_m2"], 0.25);
    EXPECT_EQ(json["occupied_m2"], 0.5);
    std::filesystem::remove(folder / "theirs.pgm");
    const Outcome broken = run(folder, "info theirs.yaml");
    EXPECT_EQ(broken.code, 1);
    EXPECT_THAT(broken.err, HasSubstr("theirs.pgm"));
}

TEST(Info, DamagedMapIsNamed) {
    const TempFolder folder;
    record_drive(folder / "drive", {});
    run_well(folder, "map drive --out hall --quiet");
    std::string points = bytes_of(folder / "hall/points.ply");
    points[points.size() / 2] = static_cast<char>(points[points.size() / 2] ^ 1);
    folder.write("hall/points.ply", points);
    const Outcome outcome = run(folder, "info hall");
    EXPECT_EQ(outcome.code, 1);
    EXPECT_THAT(outcome.err, HasSubstr("hall/points.ply: damaged: its CRC-32 does not fit"));
    EXPECT_EQ(outcome.out, "");
}

TEST(Info, OfSomethingElseIsAnError) {
    const TempFolder folder;
    std::filesystem::create_directory(folder / "empty");
    EXPECT_THAT(run(folder, "info empty").err, HasSubstr("neither a recording nor a map"));
    EXPECT_THAT(run(folder, "info nowhere").err, HasSubstr("no such folder"));
    EXPECT_EQ(run(folder, "info nowhere").code, 1);
    EXPECT_EQ(run(folder, "info").code, 2);
}

}  // namespace
}  // namespace hybrid_slam::test
