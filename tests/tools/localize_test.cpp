// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "child.hpp"
#include "localized_room.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(Localize, FindsItselfAndKeepsThePlace) {
    const TempFolder folder;
    map_room(folder);
    const Outcome outcome =
        run_well(folder,
                 "localize room second.clf --out run --truth second.truth.tum --map-truth "
                 "room.truth.tum --json");
    const Json summary = outcome.json();
    EXPECT_EQ(summary, Json::parse(bytes_of(folder / "run/summary.json")));
    const std::size_t scans = read_tum(folder / "second.truth.tum").size();
    EXPECT_EQ(summary["scans"], scans);
    EXPECT_EQ(summary["finished"], true);
    EXPECT_EQ(summary["found_after_s"], 0.0);
    EXPECT_GT(summary["statuses"]["tracking"]["share"], 0.9);
    EXPECT_EQ(summary["jumps"]["count"], 0);
    EXPECT_EQ(summary["searches"]["by_verdict"]["found"], 1);
    EXPECT_GT(summary["mean_score"], 0.8);
    EXPECT_EQ(summary["truth"]["alignment"], "none");
    EXPECT_LT(summary["truth"]["ate_rmse_m"], 0.03);
    EXPECT_EQ(summary["truth"]["used"], scans);
    EXPECT_EQ(read_tum(folder / "run/trajectory.tum").size(), scans);
    EXPECT_EQ(lines_of(folder / "run/poses.csv").size(), scans + 1);
    EXPECT_EQ(bytes_of(folder / "run/localize.png").substr(1, 3), "PNG");
    EXPECT_THAT(bytes_of(folder / "run/config.yaml"), HasSubstr("relocalization:"));
    EXPECT_FALSE(std::filesystem::exists(folder / "run/camera_poses.tum")) << "it has no camera";
}

TEST(Localize, RowsHaveAsManyFieldsAsTheHeading) {
    const TempFolder folder;
    map_square(folder);
    run(folder, "localize square square.clf --out run --quiet");  // never found: no poses
    run(folder, "localize square square.clf --out known --initial-pose 0,0,0 --quiet");
    for (const char* run : {"run", "known"}) {
        const std::vector<std::string> lines = lines_of(folder / run / "poses.csv");
        ASSERT_GT(lines.size(), 10U);
        const auto commas = std::count(lines[0].begin(), lines[0].end(), ',');
        for (const std::string& line : lines) {
            ASSERT_EQ(std::count(line.begin(), line.end(), ','), commas) << line;
        }
    }
}

TEST(Localize, SaysItInWords) {
    const TempFolder folder;
    map_room(folder);
    const Outcome outcome =
        run_well(folder, "localize room second.clf --out run --truth second.truth.tum");
    for (const char* part : {"drive      ", "place      found after 0.0 s; tracking ",
                             "fit        score ", "jumps      0", "truth      RMSE ",
                             "the map's frame is its own", "time       ", "run        run"}) {
        EXPECT_THAT(outcome.out, HasSubstr(part));
    }
}

TEST(Localize, TwoRunsGiveTheSameBytes) {
    const TempFolder folder;
    map_room(folder);
    run_well(folder, "localize room second.clf --out first");
    run_well(folder, "localize room second.clf --out second --quiet --json");
    for (const char* name : {"poses.csv", "events.jsonl", "trajectory.tum", "last_pose.json",
                             "config.yaml", "localize.png"}) {
        EXPECT_TRUE(same_bytes(folder / "first" / name, folder / "second" / name)) << name;
    }
    Json first = Json::parse(bytes_of(folder / "first/summary.json"));
    Json second = Json::parse(bytes_of(folder / "second/summary.json"));
    for (Json* summary : {&first, &second}) {
        EXPECT_EQ(summary->erase("timings") + summary->erase("memory"), 2U);
    }
    EXPECT_EQ(first, second);
}

TEST(Localize, IsAsSureAsTheMapIsFine) {
    const TempFolder folder;
    map_room(folder);
    run_well(folder, "map room.clf --out coarse --set map.resolution=0.1 --quiet");
    run_well(folder, "localize coarse/map.yaml second.clf --out run --quiet");
    const Trajectory truth = read_tum(folder / "second.truth.tum");
    const TrajectoryIndex index(truth);
    const Pose2d map_from_world = world_from_room(folder).inverse();
    double squares = 0.0;
    const std::vector<std::string> rows = lines_of(folder / "run/poses.csv");
    ASSERT_GT(rows.size(), 20U);
    for (std::size_t i = 1; i < rows.size(); ++i) {
        std::istringstream row(rows[i]);
        std::vector<std::string> fields;
        for (std::string field; std::getline(row, field, ',');) {
            fields.push_back(field);
        }
        const Pose2d there = map_from_world * index.nearest(std::stod(fields[0]), 0.001).value();
        const double x_sigma = std::stod(fields[5]);
        EXPECT_GT(x_sigma, 0.1 / std::sqrt(12.0));
        EXPECT_LT(x_sigma, 0.06);
        squares += std::pow((std::stod(fields[2]) - there.x()) / x_sigma, 2) +
                   std::pow((std::stod(fields[3]) - there.y()) / std::stod(fields[6]), 2);
    }
    EXPECT_LT(squares / static_cast<double>(rows.size() - 1), 5.0) << "2 would be honest";
}

TEST(Localize, ATruthThatIsNotThereCostsNoDrive) {
    const TempFolder folder;
    map_room(folder);
    folder.write("letter.tum", "Dear Anna,\n");
    const std::pair<const char*, const char*> kCases[] = {
        {"--truth nowhere.tum", "nowhere.tum"},
        {"--truth letter.tum", "letter.tum:1"},
        {"--relations nowhere.txt", "nowhere.txt"},
        {"--truth second.truth.tum --map-truth nowhere.tum", "nowhere.tum"},
        {"--map-truth room.truth.tum", "--map-truth: there is no --truth"}};
    for (const auto& [options, part] : kCases) {
        const Outcome outcome =
            run(folder, std::string("localize room second.clf --out run ") + options);
        EXPECT_EQ(outcome.code, 1) << options;
        EXPECT_THAT(outcome.err, HasSubstr(part));
        EXPECT_FALSE(std::filesystem::exists(folder / "run")) << options;
    }
}

TEST(Localize, NeverFoundHasItsExitCodes) {
    const TempFolder folder;
    map_square(folder);
    simulate_elsewhere(folder);
    Outcome outcome = run(folder, "localize square square.clf --out run");
    EXPECT_EQ(outcome.code, 5);
    EXPECT_THAT(outcome.out, HasSubstr("never found, several places look alike (searches: "));
    EXPECT_FALSE(std::filesystem::exists(folder / "run/trajectory.tum"));
    EXPECT_FALSE(std::filesystem::exists(folder / "run/last_pose.json"));
    EXPECT_TRUE(std::filesystem::exists(folder / "run/localize.png"));
    outcome = run(folder, "localize square elsewhere.clf --out run");
    EXPECT_EQ(outcome.code, 6);
    EXPECT_THAT(outcome.out, HasSubstr("never found, not in this map (searches: "));
}

TEST(Localize, WritesOnlyIntoItsOwnFolders) {
    const TempFolder folder;
    map_room(folder);
    for (const char* out : {"room", "."}) {
        const std::string before = bytes_of(folder / "room/manifest.json");
        const Outcome outcome = run(folder, std::string("localize room second.clf --out ") + out);
        EXPECT_EQ(outcome.code, 1);
        EXPECT_THAT(outcome.err, HasSubstr("not a localization run"));
        EXPECT_EQ(bytes_of(folder / "room/manifest.json"), before);
    }
    run_well(folder, "localize room second.clf --out run --quiet");
    run_well(folder, "localize room room.clf --out run --quiet");
    EXPECT_EQ(Json::parse(bytes_of(folder / "run/summary.json"))["drive"], "room.clf");
}

TEST(Localize, AFailureLeavesTheRunBefore) {
    const TempFolder folder;
    map_room(folder);
    folder.write("letter.clf", "Dear Anna,\nthis is no log.\n");
    run_well(folder, "localize room second.clf --out run --quiet");
    const std::string before = bytes_of(folder / "run/summary.json");
    for (const char* arguments :
         {"localize room letter.clf --out run", "localize room nowhere.clf --out run",
          "localize nowhere second.clf --out run",
          "localize room second.clf --out run --set tracking.window=0"}) {
        EXPECT_EQ(run(folder, arguments).code, 1) << arguments;
        EXPECT_EQ(bytes_of(folder / "run/summary.json"), before) << arguments;
    }
    EXPECT_EQ(run(folder, "localize room letter.clf --out new").code, 1);
    EXPECT_FALSE(std::filesystem::exists(folder / "new"));
}

TEST(Localize, WrongUsageIsTwo) {
    const TempFolder folder;
    for (const char* arguments :
         {"localize", "localize m d", "localize m --out r", "localize m d --live --out r",
          "localize m d --out r --lidar /dev/null", "localize m d --out r --initial-pose 1,2",
          "localize m d --out r --initial-pose 1,2,3 --resume r",
          "localize m d --out r --initial-sigma 1,2",
          "localize m d --out r --initial-pose 1,2,3 --initial-sigma 0,2",
          "localize m d --out r --initial-pose 1,2,nan"}) {
        EXPECT_EQ(run(folder, arguments).code, 2) << arguments;
    }
    EXPECT_THAT(run_well(folder, "localize --help").out, HasSubstr("Exit codes: 0 done; 5 never"));
}

TEST(Localize, ASignalLosesNothing) {
    const TempFolder folder;
    map_room(folder);
    write_long_drive(folder);
    const Child child(folder, "localize room long.clf --out run");
    child.wait_until_it_catches_signals();
    for (int i = 0; i < 2000 && !std::filesystem::exists(folder / "run/last_pose.json"); ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));  // it is written once a second
    }
    child.send(SIGTERM);
    const int status = child.wait();
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 3) << bytes_of(folder / "stderr.txt");
    EXPECT_THAT(bytes_of(folder / "stderr.txt"),
                HasSubstr("interrupted; all up to there is saved"));
    const Json summary = Json::parse(bytes_of(folder / "run/summary.json"));
    EXPECT_EQ(summary["interrupted"], true);
    EXPECT_EQ(lines_of(folder / "run/poses.csv").size(), summary["scans"].get<std::size_t>() + 1);
    EXPECT_FALSE(read_tum(folder / "run/trajectory.tum").empty());
    EXPECT_TRUE(std::filesystem::exists(folder / "run/localize.png"));
}

TEST(Localize, AKilledProgramHasLeftItsLastPose) {
    const TempFolder folder;
    map_room(folder);
    write_long_drive(folder);
    const Child child(folder, "localize room long.clf --out run");
    for (int i = 0; i < 2000 && !std::filesystem::exists(folder / "run/last_pose.json"); ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    child.send(SIGKILL);
    EXPECT_TRUE(WIFSIGNALED(child.wait()));
    EXPECT_GT(lines_of(folder / "run/poses.csv").size(), 10U);
    EXPECT_EQ(Json::parse(bytes_of(folder / "run/summary.json"))["finished"], false);
    run_well(folder, "localize room second.clf --out run --resume run --quiet");
    EXPECT_EQ(events_of(folder, "start").at(0)["from"], "last pose");
}

TEST(Localize, ThatNothingCameIsNoSuccess) {
    const TempFolder folder;
    map_room(folder);
    const Child child(folder, "localize room --live --lidar no_port --no-camera --out run");
    for (int i = 0; i < 2000 && bytes_of(folder / "stderr.txt").empty(); ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    child.send(SIGINT);
    const int status = child.wait();
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 3);
    EXPECT_THAT(bytes_of(folder / "stderr.txt"),
                StartsWith("hybrid-slam: lidar: no_port: No such"));
    EXPECT_THAT(bytes_of(folder / "stderr.txt"), HasSubstr("interrupted before a scan came"));
    EXPECT_FALSE(std::filesystem::exists(folder / "run"));
}

/// The whole live path: a simulated scanner speaks through a pseudo-terminal until it ends.
TEST(Localize, KeepsThePlaceLiveUntilItIsInterrupted) {
    const TempFolder folder;
    map_room_by_forklift(folder);
    const std::string program = "'" HYBRID_SLAM_PROGRAM "' ";
    const std::string serve =
        program + "simulate room.yaml --serial scanner --set distance=3 -q >&2 & ";
    const Outcome outcome = run(
        folder, "--version >&2; " + serve + "timeout --preserve-status --foreground -s INT 5 " +
                    program + "localize room --live --lidar scanner --no-camera --out run --json");
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("hybrid-slam: lidar: streaming"));
    EXPECT_THAT(outcome.err, HasSubstr("hybrid-slam: tracking: x "));
    const Json summary = outcome.json();
    EXPECT_EQ(summary["interrupted"], false);
    EXPECT_GT(summary["scans"], 10U);
    EXPECT_GT(summary["statuses"]["tracking"]["share"], 0.5);
    EXPECT_TRUE(std::filesystem::exists(folder / "run/last_pose.json"));
    EXPECT_THAT(bytes_of(folder / "run/config.yaml"), HasSubstr("max_seconds: 0.5 "));
}

}  // namespace
}  // namespace hybrid_slam::test
