// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <set>

#include "hybrid_slam/backend/map_folder.hpp"
#include "hybrid_slam/core/metrics.hpp"
#include "running.hpp"
#include "support/shared_data.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::set<std::string> names_in(const std::filesystem::path& folder) {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        names.insert(entry.path().filename().string());
    }
    return names;
}

/// Without what may differ from run to run.
Json steady_part(const std::filesystem::path& summary) {
    Json json = Json::parse(bytes_of(summary));
    EXPECT_EQ(json.erase("timings"), 1U);
    EXPECT_EQ(json.erase("memory"), 1U);
    return json;
}

TEST(Map, WritesAMapThatCanBeReadAndIsTrue) {
    const TempFolder folder;
    simulate_room(folder);
    const Outcome result = run_well(folder, "map room.clf --out room");
    EXPECT_THAT(result.out, HasSubstr("closures"));
    EXPECT_EQ(
        names_in(folder / "room"),
        (std::set<std::string>{"config.yaml", "graph.g2o", "graph.png", "keyframes.bin",
                               "manifest.json", "map.pgm", "map.png", "map.yaml", "odometry.tum",
                               "points.ply", "pyramid.bin", "summary.json", "trajectory.tum"}));
    const StoredMap map = read_map(folder / "room");
    EXPECT_EQ(map.keyframes.size(), map.graph.nodes.size());
    const TruthError error = truth_error(map.trajectory, read_tum(folder / "room.truth.tum"));
    EXPECT_EQ(error.unmatched, 0U);
    EXPECT_LT(error.ate_rmse, 0.05);
}

TEST(Map, SummaryCountsWhatTheLogHolds) {
    const TempFolder folder;
    simulate_room(folder);
    const Json printed = run_well(folder, "map room.clf --out room --json").json();
    EXPECT_EQ(printed, Json::parse(bytes_of(folder / "room/summary.json")));
    const Trajectory truth = read_tum(folder / "room.truth.tum");
    EXPECT_EQ(printed["scans"], truth.size());
    EXPECT_EQ(printed["input"]["scans"], truth.size());
    EXPECT_EQ(printed["priors_used"]["wheel"], truth.size() - 1);
    EXPECT_EQ(printed["odometry_status"]["first"], 1);
    EXPECT_EQ(printed["interrupted"], false);
    EXPECT_NEAR(printed["duration_s"].get<double>(), truth.back().stamp - truth.front().stamp,
                1e-6);
    EXPECT_EQ(printed["closures"]["list"].size(), printed["closures"]["tried"]);
    EXPECT_EQ(printed["keyframes"], printed["graph"]["nodes"]);
    const Json& timings = printed["timings"];
    EXPECT_GE(timings["odometry"]["max_ms"], timings["odometry"]["mean_ms"]);
    EXPECT_GT(timings["scans_per_s"], 0.0);
    EXPECT_GT(printed["memory"]["peak_mb"], 1.0);
}

TEST(Map, TwoRunsGiveTheSameBytes) {
    const TempFolder folder;
    simulate_room(folder);
    run_well(folder, "map room.clf --out first");
    run_well(folder, "map room.clf --out second --quiet --json");
    const std::set<std::string> names = names_in(folder / "first");
    ASSERT_EQ(names, names_in(folder / "second"));
    for (const std::string& name : names) {
        // The manifest has the checksum of the summary, whose timings differ.
        if (name != "summary.json" && name != "manifest.json") {
            EXPECT_TRUE(same_bytes(folder / ("first/" + name), folder / ("second/" + name)))
                << name;
        }
    }
    EXPECT_EQ(steady_part(folder / "first/summary.json"),
              steady_part(folder / "second/summary.json"));
}

TEST(Map, EffectiveConfigurationGivesTheSameMapAgain) {
    const TempFolder folder;
    simulate_room(folder);
    run_well(folder,
             "map room.clf --out first --set icp.max_iterations=7 --set map.resolution=0.1");
    run_well(folder, "map room.clf --out second --config first/config.yaml");
    EXPECT_THAT(bytes_of(folder / "second/config.yaml"), HasSubstr("max_iterations: 7 "));
    EXPECT_TRUE(same_bytes(folder / "first/config.yaml", folder / "second/config.yaml"));
    EXPECT_TRUE(same_bytes(folder / "first/map.pgm", folder / "second/map.pgm"));
    EXPECT_THAT(bytes_of(folder / "first/map.yaml"), HasSubstr("resolution: 0.1"));
}

TEST(Map, WithoutGraphTheTrajectoryIsTheOdometry) {
    const TempFolder folder;
    simulate_room(folder);
    const Json summary = run_well(folder, "map room.clf --out room --no-graph --json").json();
    EXPECT_EQ(summary["closures"]["tried"], 0);
    EXPECT_TRUE(same_bytes(folder / "room/trajectory.tum", folder / "room/odometry.tum"));
}

TEST(Map, PlainIcpUsesNoPrior) {
    const TempFolder folder;
    simulate_room(folder);
    const Json summary =
        run_well(folder, "map room.clf --out room --json --config '" HYBRID_SLAM_SOURCE_DIR
                         "/config/plain_icp.yaml'")
            .json();
    EXPECT_EQ(summary["priors_used"].size(), 1U);
    EXPECT_EQ(summary["priors_used"]["none"], summary["scans"].get<int>() - 1);
}

TEST(Map, ReplacesAMapButNothingElse) {
    const TempFolder folder;
    simulate_room(folder);
    run_well(folder, "map room.clf --out room");
    run_well(folder, "map room.clf --out room --set map.resolution=0.1");
    EXPECT_THAT(bytes_of(folder / "room/map.yaml"), HasSubstr("resolution: 0.1"));
    std::filesystem::create_directory(folder / "letters");
    folder.write("letters/to_anna.txt", "Dear Anna");
    const Outcome result = run(folder, "map room.clf --out letters");
    EXPECT_EQ(result.code, 1);
    EXPECT_THAT(result.err, HasSubstr("letters"));
    EXPECT_EQ(bytes_of(folder / "letters/to_anna.txt"), "Dear Anna");
}

TEST(Map, LogWithoutAUsableScanIsAnErrorAndLeavesNothing) {
    const TempFolder folder;
    folder.write("blind.clf",
                 "FLASER 3 81.9 81.9 81.9 0 0 0 0 0 0 1.0 host 1.0\n"
                 "FLASER 3 81.9 81.9 81.9 0 0 0 0 0 0 2.0 host 2.0\n");
    const std::set<std::string> before = names_in(folder.path());
    Outcome result = run(folder, "map blind.clf --out blind");
    EXPECT_EQ(result.code, 1);
    EXPECT_EQ(result.err, "hybrid-slam: blind.clf: no usable scan in it\n");
    folder.write("letter.clf", "Dear Anna,\nthis is no log.\n");
    result = run(folder, "map letter.clf --out letter");
    EXPECT_EQ(result.code, 1);
    EXPECT_THAT(result.err, HasSubstr("letter.clf"));
    for (const std::string& name : names_in(folder.path())) {
        EXPECT_TRUE(before.count(name) == 1 || name == "letter.clf" || name == "stdout.txt" ||
                    name == "stderr.txt")
            << name;
    }
}

TEST(Map, OddThingsInTheLogAreToldOnce) {
    const TempFolder folder;
    simulate_room(folder);
    std::string log = bytes_of(folder / "room.clf");
    log += "FLASER 3 1.0 torn";
    folder.write("torn.clf", log);
    const Outcome result = run_well(folder, "map torn.clf --out torn --json");
    EXPECT_THAT(result.err, HasSubstr("hybrid-slam: torn.clf: "));
    EXPECT_EQ(result.json()["warnings"].size(), 1U);
    EXPECT_THAT(run_well(folder, "map torn.clf --out torn --quiet").err, IsEmpty());
}

TEST(Map, MitCsailMeetsItsFigures) {
    HYBRID_SLAM_SHARED_OR_SKIP(log, "data/slam2d/mit-csail.clf.gz");
    HYBRID_SLAM_SHARED_OR_SKIP(relations, "data/slam2d/mit-csail.relations");
    const TempFolder folder;
    run_well(folder, "map '" + log.string() + "' --out csail --json");
    const RelationsError error =
        relations_error(read_tum(folder / "csail/trajectory.tum"), read_relations(relations));
    EXPECT_LT(error.translation.mean, 0.045);
    EXPECT_LT(degrees(error.rotation.mean), 1.1);
}

}  // namespace
}  // namespace hybrid_slam::test
