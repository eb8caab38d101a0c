// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <csignal>
#include <fstream>

#include "child.hpp"
#include "hybrid_slam/backend/map_folder.hpp"
#include "running.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;

/// The room driven around so often that no run comes to the end before a signal does.
std::size_t write_long_log(const TempFolder& folder) {
    constexpr std::size_t kTimes = 150;
    simulate_room(folder);
    const std::string once = bytes_of(folder / "room.clf");
    std::ofstream stream(folder / "long.clf", std::ios::binary);
    for (std::size_t i = 0; i < kTimes; ++i) {
        stream << once;
    }
    return kTimes * read_tum(folder / "room.truth.tum").size();
}

class Interrupt : public ::testing::TestWithParam<int> {};

TEST_P(Interrupt, SavesTheMapOfTheScansSoFar) {
    const TempFolder folder;
    const std::size_t whole = write_long_log(folder);
    const Child child(folder, "map long.clf --out room");
    child.wait_until_it_catches_signals();
    child.send(GetParam());
    const int status = child.wait();
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 3) << bytes_of(folder / "stderr.txt");
    EXPECT_THAT(bytes_of(folder / "stderr.txt"), HasSubstr("interrupted"));
    const Json summary = Json::parse(bytes_of(folder / "room/summary.json"));
    EXPECT_EQ(summary["interrupted"], true);
    const StoredMap map = read_map(folder / "room");
    EXPECT_EQ(map.trajectory.size(), summary["scans"].get<std::size_t>());
    EXPECT_GT(map.trajectory.size(), 0U);
    EXPECT_LT(map.trajectory.size(), whole);
}

INSTANTIATE_TEST_SUITE_P(Signals, Interrupt, ::testing::Values(SIGINT, SIGTERM));

TEST(InterruptTwice, AbortsAtOnce) {
    const TempFolder folder;
    write_long_log(folder);
    const Child child(folder, "map long.clf --out room");
    child.wait_until_it_catches_signals();
    // Two of a kind could arrive as one.
    child.send(SIGINT);
    child.send(SIGTERM);
    const int status = child.wait();
    EXPECT_TRUE(WIFSIGNALED(status)) << bytes_of(folder / "stderr.txt");
    EXPECT_FALSE(std::filesystem::exists(folder / "room"));
}

TEST(InterruptCompare, SaysSoAndWritesNoPartOfATable) {
    const TempFolder folder;
    write_long_log(folder);
    const Child child(folder, "compare long.clf --truth room.truth.tum --out there");
    child.wait_until_it_catches_signals();
    child.send(SIGINT);
    EXPECT_EQ(WEXITSTATUS(child.wait()), 3);
    EXPECT_THAT(bytes_of(folder / "stderr.txt"), HasSubstr("interrupted"));
    EXPECT_FALSE(std::filesystem::exists(folder / "there/compare.json"));
}

TEST(InterruptSimulate, LogAndTruthEndTogether) {
    const TempFolder folder;
    write_room(folder);
    const Child child(folder,
                      "simulate room.yaml --out long.clf --set speed=0.01 --set scan_rate=1000");
    child.wait_until_it_catches_signals();
    child.send(SIGTERM);
    EXPECT_EQ(WEXITSTATUS(child.wait()), 3);
    const Trajectory truth = read_tum(folder / "long.truth.tum");
    const std::string log = bytes_of(folder / "long.clf");
    std::size_t scans = 0;
    for (std::size_t at = log.find("FLASER "); at != std::string::npos;
         at = log.find("\nFLASER ", at + 1)) {
        ++scans;
    }
    EXPECT_EQ(scans, truth.size());
    EXPECT_EQ(log.back(), '\n');
}

}  // namespace
}  // namespace hybrid_slam::test
