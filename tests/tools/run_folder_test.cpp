// SPDX-License-Identifier: Apache-2.0
#include "run_folder.hpp"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "last_pose.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam::test {
namespace {

using namespace tools;
using ::testing::HasSubstr;

namespace fs = std::filesystem;

LastPose some_pose() {
    LastPose last;
    last.map = "hall";
    last.map_identity = "0123abcd";
    last.stamp = 1700000000.5;
    last.map_from_robot = Pose2d(1.25, -3.1, 2.9);
    last.covariance << 1e-4, 1e-5, 2e-6, 1e-5, 3e-4, -1e-6, 2e-6, -1e-6, 1e-5;
    last.score = 0.75;
    return last;
}

TEST(RunFolder, LeavesNothingWhenNothingBegan) {
    const TempFolder folder;
    { const RunFolder run(folder / "deep/run"); }
    EXPECT_FALSE(fs::exists(folder / "deep/run"));
}

TEST(RunFolder, TakesOnlyWhatIsNewEmptyOrARun) {
    const TempFolder folder;
    folder.write("file", "x");
    fs::create_directory(folder / "letters");
    folder.write("letters/summary.json", "{\"format\": \"hybrid_slam map\"}");
    for (const char* name : {"file", "letters"}) {
        EXPECT_THAT(error_of([&] { RunFolder(folder / name); }), HasSubstr(name));
    }
    fs::create_directory(folder / "empty");
    RunFolder(folder / "empty").begin(false);
    EXPECT_NO_THROW(RunFolder(folder / "empty"));
}

TEST(RunFolder, BeginningRemovesTheRunBeforeAndNothingElse) {
    const TempFolder folder;
    RunFolder(folder / "run").begin(false);
    for (const char* name : {"poses.csv", "localize.png", "last_pose.json", "notes.txt"}) {
        folder.write(std::string("run/") + name, name);
    }
    const RunFolder run(folder / "run");
    EXPECT_TRUE(fs::exists(folder / "run/poses.csv")) << "not before it begins";
    run.begin(true);
    EXPECT_FALSE(fs::exists(folder / "run/poses.csv"));
    EXPECT_FALSE(fs::exists(folder / "run/localize.png"));
    EXPECT_TRUE(fs::exists(folder / "run/last_pose.json"));
    EXPECT_TRUE(fs::exists(folder / "run/notes.txt"));
    run.begin(false);
    EXPECT_FALSE(fs::exists(folder / "run/last_pose.json"));
    const auto summary = nlohmann::json::parse(bytes_of(folder / "run/summary.json"));
    EXPECT_EQ(summary["finished"], false);
}

TEST(RunFolder, IsFilledByOneAtATime) {
    const TempFolder folder;
    const RunFolder run(folder / "run");
    run.begin(false);
    EXPECT_THAT(error_of([&] { RunFolder(folder / "run"); }),
                HasSubstr("run: another process fills it"));
}

TEST(RunFolder, FullDiskIsAnError) {
    if (!fs::exists("/dev/full")) {
        GTEST_SKIP() << "no /dev/full here";
    }
    LineFile file("/dev/full");
    EXPECT_THAT(error_of([&] {
                    file.add("something");
                    file.flush();
                }),
                HasSubstr("/dev/full: No space left"));
}

TEST(LastPose, ComesBackToTheBit) {
    const TempFolder folder;
    const LastPose last = some_pose();
    write_last_pose(folder / "last_pose.json", last);
    const LastPose back = read_last_pose(folder / "last_pose.json");
    EXPECT_EQ(back.map, last.map);
    EXPECT_EQ(back.map_identity, last.map_identity);
    EXPECT_EQ(back.stamp, last.stamp);
    EXPECT_EQ(back.map_from_robot.translation, last.map_from_robot.translation);
    EXPECT_NEAR(back.map_from_robot.heading, last.map_from_robot.heading, 1e-15);
    EXPECT_EQ(back.covariance, last.covariance);
    EXPECT_EQ(back.score, last.score);
    EXPECT_FALSE(fs::exists(folder / "last_pose.json.part"));
}

TEST(LastPose, DamageIsToldPlainly) {
    const TempFolder folder;
    write_last_pose(folder / "good.json", some_pose());
    const std::string good = bytes_of(folder / "good.json");
    const auto error_with = [&](const std::string& from, const std::string& to) {
        std::string text = good;
        const std::size_t at = text.find(from);
        EXPECT_NE(at, std::string::npos) << from;
        const auto file = folder.write("bad.json", text.replace(at, from.size(), to));
        return error_of([&] { read_last_pose(file); });
    };
    EXPECT_THAT(error_with("hybrid_slam last pose", "else"),
                HasSubstr("bad.json: is no last pose"));
    EXPECT_THAT(error_with("{", "["), HasSubstr("bad.json: is no last pose"));
    EXPECT_THAT(error_with("\"version\": 1", "\"version\": 2"), HasSubstr("has version 2"));
    EXPECT_THAT(error_with("\"x_m\"", "\"x\""), HasSubstr("bad.json: damaged"));
    EXPECT_THAT(error_with("1.25", "\"1.25\""), HasSubstr("bad.json: damaged"));
    EXPECT_THAT(error_with("0.0001", "-0.0001"), HasSubstr("bad.json: damaged"));
    EXPECT_THAT(error_with("0.0001", "null"), HasSubstr("bad.json: damaged"));
}

}  // namespace
}  // namespace hybrid_slam::test
