// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "localized_room.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

/// The true pose of the second drive in the map.
Pose2d truth_at(const TempFolder& folder, double stamp) {
    const Trajectory truth = read_tum(folder / "second.truth.tum");
    return world_from_room(folder).inverse() * TrajectoryIndex(truth).nearest(stamp, 0.001).value();
}

void expect_true(const TempFolder& folder, const Json& answer) {
    EXPECT_EQ(answer["verdict"], "found");
    const Pose2d off =
        between(truth_at(folder, answer["asked"]["stamp"]), pose_of(answer["places"][0]["pose"]));
    EXPECT_LT(off.translation.norm(), 0.03);
    EXPECT_LT(std::abs(degrees(off.heading)), 0.5);
}

TEST(Relocalize, FindsAScanOfADrive) {
    const TempFolder folder;
    map_room(folder);
    const Json answer = run_well(folder, "relocalize room second.clf --at 3.9 --json").json();
    expect_true(folder, answer);
    EXPECT_NEAR(answer["asked"]["stamp"], 4.0, 0.101);
    EXPECT_EQ(answer["asked"]["scans"], 1);
    EXPECT_EQ(answer["asked"]["path_m"], 0.0);
    const Json& best = answer["places"][0];
    EXPECT_GT(best["fit"]["explained"], 0.95);
    EXPECT_GT(best["sigma"]["x_m"], 0.0);
    EXPECT_LT(best["sigma"]["x_m"], 0.02);
    EXPECT_NEAR(best["covariance"][0][0].get<double>(),
                std::pow(best["sigma"]["x_m"].get<double>(), 2), 1e-7);
    EXPECT_GT(answer["nodes"], 0U);
    EXPECT_GT(answer["timings"]["search_ms"], 0.0);
}

TEST(Relocalize, ASavedScanIsAnsweredAlike) {
    const TempFolder folder;
    map_room(folder);
    const Json of_drive =
        run_well(folder, "relocalize room second.clf --at 4 --save-scan scan.json --json").json();
    const Json of_scan = run_well(folder, "relocalize room --scan scan.json --json").json();
    EXPECT_EQ(of_drive["places"], of_scan["places"]);
    EXPECT_EQ(of_drive["nodes"], of_scan["nodes"]);
    EXPECT_EQ(of_drive["asked"]["stamp"], of_scan["asked"]["stamp"]);
    EXPECT_EQ(of_drive["map"], of_scan["map"]);
}

TEST(Relocalize, ScansOfAWayAreTiedByOdometry) {
    const TempFolder folder;
    map_room(folder);
    const Json answer =
        run_well(folder, "relocalize room second.clf --at 1 --drive 2 --json").json();
    expect_true(folder, answer);
    EXPECT_GE(answer["asked"]["path_m"], 2.0);
    EXPECT_LT(answer["asked"]["path_m"], 2.5);
    EXPECT_GT(answer["asked"]["scans"], 5U);
    EXPECT_GT(answer["asked"]["stamp"], 2.9);
    const Outcome too_far = run_well(folder, "relocalize room second.clf --drive 500 --json");
    EXPECT_THAT(too_far.err, HasSubstr("second.clf ends after"));
    EXPECT_EQ(too_far.json()["asked"]["complete"], false);
    expect_true(folder, too_far.json());
}

TEST(Relocalize, TellsItInWords) {
    const TempFolder folder;
    map_room(folder);
    const Outcome outcome = run_well(folder, "relocalize room second.clf --png there.png");
    for (const char* part : {"found      x ", "sigma      ", "score      ", "runner-up  ",
                             "asked      1 scan with ", "effort     "}) {
        EXPECT_THAT(outcome.out, HasSubstr(part));
    }
    EXPECT_THAT(bytes_of(folder / "there.png"), StartsWith("\x89PNG"));
}

TEST(Relocalize, FindsItInAMapServerMapToo) {
    const TempFolder folder;
    map_room(folder);
    expect_true(folder, run_well(folder, "relocalize room/map.yaml second.clf --json").json());
}

TEST(Relocalize, SquareRoomIsAmbiguous) {
    const TempFolder folder;
    map_square(folder);
    Outcome outcome = run(folder, "relocalize square square.clf --at 1 --png places.png");
    EXPECT_EQ(outcome.code, 5);
    EXPECT_THAT(outcome.out, StartsWith("ambiguous  4 places look alike"));
    EXPECT_THAT(outcome.out, HasSubstr("drive a little"));
    EXPECT_THAT(bytes_of(folder / "places.png"), StartsWith("\x89PNG"));
    outcome = run(folder, "relocalize square square.clf --drive 3 --json");
    EXPECT_EQ(outcome.code, 5);
    EXPECT_EQ(outcome.json()["verdict"], "ambiguous");
    EXPECT_EQ(outcome.json()["places"].size(), 4U);
}

TEST(Relocalize, ElsewhereIsNotInTheMap) {
    const TempFolder folder;
    map_room(folder);
    simulate_elsewhere(folder);
    const Outcome outcome = run(folder, "relocalize room elsewhere.clf --at 1");
    EXPECT_EQ(outcome.code, 6);
    EXPECT_THAT(outcome.out, StartsWith("not in map"));
    EXPECT_THAT(outcome.out, Not(HasSubstr("found  ")));
}

TEST(Relocalize, ThesisMethodIsAValueOfAnOption) {
    const TempFolder folder;
    map_room(folder);
    const std::string headings =
        "relocalize room second.clf --at 4 --json --set relocalization.method=headings";
    expect_true(folder, run_well(folder, headings).json());
    const Json of_one = run(folder, headings + " --set relocalization.headings=1").json();
    EXPECT_LT(of_one["places"][0]["fit"]["explained"], 0.9) << "one heading is not enough";
}

TEST(Relocalize, WhatIsMissingOrWrongIsNamed) {
    const TempFolder folder;
    map_room(folder);
    folder.write("blind.json", R"({"ranges": [null, null, 99], "angle_min": 0,
        "angle_increment": 0.1, "range_max": 30})");
    folder.write("one.json", R"({"ranges": [3], "angle_min": 0,
        "angle_increment": 0.1, "range_max": 30})");
    const std::pair<const char*, const char*> kCases[] = {
        {"relocalize nowhere second.clf", "nowhere"},
        {"relocalize second.clf second.clf", "second.clf: is a file, not a map; 'hybrid-slam map'"},
        {"relocalize room --scan one.json", "one.json: key 'ranges' has 1 return of use, at least"},
        {"relocalize room nowhere.clf", "nowhere.clf"},
        {"relocalize room --scan nowhere.json", "nowhere.json"},
        {"relocalize room --scan second.yaml", "second.yaml:1: is no JSON"},
        {"relocalize room --scan blind.json", "blind.json: no beam of the scan returned"},
        {"relocalize room second.clf --at 5000", "second.clf: no usable scan in it from 5000 s on"},
        {"relocalize room second.clf --set relocalization.margin=3", "relocalization.margin"}};
    for (const auto& [arguments, part] : kCases) {
        SCOPED_TRACE(arguments);
        const Outcome outcome = run(folder, arguments);
        EXPECT_EQ(outcome.code, 1);
        EXPECT_THAT(outcome.err, HasSubstr(part));
        EXPECT_EQ(outcome.out, "");
    }
}

TEST(Relocalize, WrongUsageIsTwo) {
    const TempFolder folder;
    for (const char* arguments :
         {"relocalize", "relocalize room", "relocalize room a.clf --scan s.json",
          "relocalize room a.clf --live", "relocalize room --scan s.json --at 3",
          "relocalize room --scan s.json --drive 3", "relocalize room --live --at 3",
          "relocalize room a.clf --lidar /dev/null", "relocalize room a.clf --drive -1"}) {
        EXPECT_EQ(run(folder, arguments).code, 2) << arguments;
    }
    const Outcome help = run_well(folder, "relocalize --help");
    EXPECT_THAT(help.out, HasSubstr("Exit codes: 0 found; 5 ambiguous"));
}

/// A simulated scanner speaks through a pseudo-terminal.
TEST(Relocalize, AsksTheLiveScanner) {
    const TempFolder folder;
    map_room_by_forklift(folder);
    const std::string program = "'" HYBRID_SLAM_PROGRAM "' ";
    const std::string serve =
        program + "simulate room.yaml --serial scanner --set distance=2 -q >&2 & ";
    const Outcome outcome =
        run(folder, "--version >&2; " + serve + "timeout 60 " + program +
                        "relocalize room --live --lidar scanner --no-camera --json");
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.json()["asked"]["of"], "live scanner");
    EXPECT_LT(pose_of(outcome.json()["places"][0]["pose"]).translation.norm(), 1.0);
}

}  // namespace
}  // namespace hybrid_slam::test
