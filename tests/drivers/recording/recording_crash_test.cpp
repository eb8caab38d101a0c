// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "crashes.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam::test {
namespace {

constexpr std::uint64_t kTail = 64 * 1024;

void expect_nothing_lost(const CutOutcome& outcome, std::uint64_t tried) {
    EXPECT_EQ(outcome.tried, tried);
    EXPECT_EQ(outcome.opened, outcome.tried);
    EXPECT_EQ(outcome.lost, 0U);
    EXPECT_EQ(outcome.wrong, 0U);
}

TEST(RecordingCrash, KilledAtFiftyMomentsNothingSyncedIsMissing) {
    const TempFolder folder;
    const KillOutcome outcome = kill_recorders(folder.path(), 50);
    EXPECT_EQ(outcome.opened, 50);
    EXPECT_EQ(outcome.missing, 0U);
    EXPECT_EQ(outcome.wrong, 0U);
    EXPECT_GT(outcome.synced, 1000U);
    EXPECT_GE(outcome.read, outcome.synced);
}

TEST(RecordingCrash, LidarFileCutAtEveryByte) {
    const TempFolder folder;
    record_drive(folder / "a", 400, 0);
    expect_nothing_lost(cut_byte_by_byte(folder / "a/lidar.rec", kTail), kTail);
}

TEST(RecordingCrash, ImageFileCutAtEveryByte) {
    const TempFolder folder;
    record_drive(folder / "a", 0, 5);
    expect_nothing_lost(cut_byte_by_byte(folder / "a/camera.rec", kTail), kTail);
}

TEST(RecordingCrash, SmallFilesCutAtEveryByteToNothing) {
    const TempFolder folder;
    record_drive(folder / "a", 4, 0);
    const std::uint64_t size = std::filesystem::file_size(folder / "a/lidar.rec");
    expect_nothing_lost(cut_byte_by_byte(folder / "a/lidar.rec", size), size);
}

TEST(RecordingCrash, LidarFileZeroedFromEveryByte) {
    const TempFolder folder;
    record_drive(folder / "a", 400, 0);
    expect_nothing_lost(zero_the_tail(folder / "a/lidar.rec", kTail, 1), kTail);
}

TEST(RecordingCrash, ImageFileZeroedFromManyBytes) {
    const TempFolder folder;
    record_drive(folder / "a", 0, 40);
    expect_nothing_lost(zero_the_tail(folder / "a/camera.rec", 1U << 20U, 1021),
                        (1U << 20U) / 1021);
}

// The whole way, over both files and the reader that merges them.
TEST(RecordingCrash, RecordingWhoseFilesAreCutIsReadAsOne) {
    const TempFolder folder;
    record_drive(folder / "a", 30, 20, 100);
    const RecordIndex lidar(folder / "a/lidar.rec");
    const RecordIndex camera(folder / "a/camera.rec");
    for (std::uint64_t size = lidar.size; size > 37; size -= 37) {
        std::filesystem::resize_file(folder / "a/lidar.rec", size);
        const std::uint64_t camera_size = std::min(size, camera.size);
        std::filesystem::resize_file(folder / "a/camera.rec", camera_size);
        RecordingReader reader(folder / "a");
        EXPECT_EQ(read_all(reader).size(), lidar.before(size) + camera.before(camera_size));
        EXPECT_EQ(reader.damaged_bytes(), 0U);
    }
}

// The check of the checks: what loses records is found out.
TEST(RecordingCrash, LossWouldBeCounted) {
    const TempFolder folder;
    record_drive(folder / "a", 40, 0);
    const std::filesystem::path file = folder / "a/lidar.rec";
    const RecordIndex whole(file);
    std::filesystem::resize_file(file, whole.size - 1);
    CutOutcome outcome;
    judge_tail(file, whole, whole.size, outcome);
    EXPECT_EQ(outcome.lost, 1U);
    KillOutcome killed;
    judge(folder / "a", {40, 0}, killed);
    EXPECT_EQ(killed.missing, 1U);
    EXPECT_EQ(killed.wrong, 0U);
}

}  // namespace
}  // namespace hybrid_slam::test
