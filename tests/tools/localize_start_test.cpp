// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <cmath>
#include <set>
#include <sstream>

#include "localized_room.hpp"

// Where `localize` starts from.
namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

/// The first or the second half of a log of scans.
void write_half(const TempFolder& folder, const std::string& log, bool second) {
    const std::vector<std::string> lines = lines_of(folder / log);
    const std::size_t middle = lines.size() / 2;
    std::string text;
    for (std::size_t i = second ? middle : 0; i < (second ? lines.size() : middle); ++i) {
        text += lines[i] + "\n";
    }
    folder.write(second ? "evening.clf" : "morning.clf", text);
}

TEST(LocalizeStart, InitialPoseSparesTheSearch) {
    const TempFolder folder;
    map_room(folder);
    const Pose2d start =
        world_from_room(folder).inverse() * read_tum(folder / "second.truth.tum").front().pose;
    std::ostringstream pose;
    pose << start.x() + 0.1 << "," << start.y() - 0.1 << "," << degrees(start.heading) + 3.0;
    run_well(folder, "localize room second.clf --out run --initial-pose=" + pose.str());
    EXPECT_EQ(events_of(folder, "start").at(0)["from"], "initial pose");
    EXPECT_TRUE(events_of(folder, "search").empty());
    run_well(folder, "localize room second.clf --out run --initial-pose " + pose.str() +
                         " --initial-sigma 0.3,5");
    EXPECT_TRUE(events_of(folder, "search").empty()) << "a minus sign is no option";
}

TEST(LocalizeStart, WrongInitialPoseIsNoticedAndAJump) {
    const TempFolder folder;
    map_room(folder);
    const Json summary = run_well(folder,
                                  "localize room second.clf --out run --initial-pose 0.5,0.5,80 "
                                  "--initial-sigma 0.1,2 --json")
                             .json();
    EXPECT_GE(summary["jumps"]["count"], 1);
    EXPECT_FALSE(events_of(folder, "jump").empty());
    EXPECT_FALSE(events_of(folder, "search").empty());
    std::set<std::string> statuses;
    for (const Json& event : events_of(folder, "status")) {
        statuses.insert(event["to"].get<std::string>());
    }
    EXPECT_EQ(statuses.count("lost"), 1U);
    EXPECT_EQ(statuses.count("tracking"), 1U);
    EXPECT_GT(summary["statuses"]["tracking"]["share"], 0.7);
    // What nobody but the user said is no place.
    EXPECT_GT(summary["found_after_s"], 0.0);
    EXPECT_LT(summary["path_length_m"], length_of(read_tum(folder / "second.truth.tum")) + 0.1);
    const Pose2d start =
        world_from_room(folder).inverse() * read_tum(folder / "second.truth.tum").front().pose;
    const StampedPose first = read_tum(folder / "run/trajectory.tum").front();
    EXPECT_GT(first.stamp, 0.0);
    EXPECT_LT((first.pose.translation - start.translation).norm(), 1.5);
    EXPECT_LT(std::abs(degrees(between(start, first.pose).heading)), 10.0);
}

TEST(LocalizeStart, AnInitialPoseBesideTheMapIsRefused) {
    const TempFolder folder;
    map_room(folder);
    for (const char* pose : {"1e7,0,0", "1e300,1e300,0", "0,-40,0"}) {
        const Outcome outcome =
            run(folder, std::string("localize room second.clf --out run --initial-pose ") + pose);
        EXPECT_EQ(outcome.code, 1);
        EXPECT_THAT(outcome.err, HasSubstr("is not in the map, which reaches from "));
        EXPECT_FALSE(std::filesystem::exists(folder / "run"));
    }
}

TEST(LocalizeStart, GoesOnWhereItWasSwitchedOff) {
    const TempFolder folder;
    map_room(folder);
    write_half(folder, "second.clf", false);
    write_half(folder, "second.clf", true);
    run_well(folder, "localize room morning.clf --out run --quiet");
    const Json last = Json::parse(bytes_of(folder / "run/last_pose.json"));
    const StampedPose end = read_tum(folder / "run/trajectory.tum").back();
    EXPECT_NEAR(last["stamp"], end.stamp, 1e-6);
    EXPECT_NEAR(last["x_m"], end.pose.x(), 1e-8);
    run_well(folder, "localize room evening.clf --out run2 --resume run");
    EXPECT_EQ(events_of(folder, "start", "run2").at(0)["from"], "last pose");
    EXPECT_TRUE(events_of(folder, "search", "run2").empty());
    run_well(folder, "localize room evening.clf --out run3 --resume run/last_pose.json");
    EXPECT_TRUE(same_bytes(folder / "run2/poses.csv", folder / "run3/poses.csv"));
}

TEST(LocalizeStart, ALastPoseOfAnotherMapIsRefused) {
    const TempFolder folder;
    map_room(folder);
    run_well(folder, "localize room second.clf --out run --quiet");
    const std::string before = bytes_of(folder / "run/last_pose.json");
    run_well(folder, "map room.clf --out finer --set map.resolution=0.04 --quiet");
    for (const char* out : {"run", "new"}) {
        const Outcome outcome =
            run(folder, std::string("localize finer second.clf --resume run --out ") + out);
        EXPECT_EQ(outcome.code, 1);
        EXPECT_THAT(outcome.err, StartsWith("hybrid-slam: run/last_pose.json: is a pose in another "
                                            "map ('room', identity "));
        EXPECT_THAT(outcome.err, HasSubstr("), not in 'finer' ("));
    }
    EXPECT_EQ(bytes_of(folder / "run/last_pose.json"), before);
    EXPECT_FALSE(std::filesystem::exists(folder / "new"));
    // The same grid is the same place, whoever wrote it down; another one is not.
    run_well(folder, "localize room/map.yaml second.clf --resume run --out grid --quiet");
    EXPECT_EQ(events_of(folder, "start", "grid").at(0)["from"], "last pose");
    EXPECT_EQ(run(folder, "localize finer/map.yaml second.clf --resume grid --out new").code, 1);
}

TEST(LocalizeStart, AServiceAlwaysResumesItsOwnRun) {
    const TempFolder folder;
    map_room(folder);
    simulate_elsewhere(folder);
    const Outcome first = run_well(folder, "localize room second.clf --out run --resume run");
    EXPECT_THAT(first.err, HasSubstr("no last pose there yet"));
    EXPECT_EQ(events_of(folder, "start").at(0)["from"], "unknown");
    run_well(folder, "localize room second.clf --out run --resume run");
    EXPECT_EQ(events_of(folder, "start").at(0)["from"], "last pose");
    run_well(folder, "localize room second.clf --out run --resume run/last_pose.json");
    EXPECT_EQ(events_of(folder, "start").at(0)["from"], "last pose") << "the file's name will do";
    // What was true of the vehicle stays true of it while nothing better is known.
    const std::string before = bytes_of(folder / "run/last_pose.json");
    EXPECT_EQ(run(folder, "localize room elsewhere.clf --out run --resume run").code, 6);
    EXPECT_EQ(bytes_of(folder / "run/last_pose.json"), before);
    EXPECT_EQ(run(folder, "localize room second.clf --out new --resume nowhere").code, 1);
    EXPECT_FALSE(std::filesystem::exists(folder / "new"));
}

}  // namespace
}  // namespace hybrid_slam::test
