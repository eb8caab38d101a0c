// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "hybrid_slam/core/metrics.hpp"
#include "running.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(Compare, TableHasAllThreeAndTheOdometry) {
    const TempFolder folder;
    simulate_room(folder);
    const Outcome result = run_well(folder, "compare room.clf --truth room.truth.tum");
    EXPECT_THAT(result.out, AllOf(HasSubstr("raw odometry  "), HasSubstr("  plain ICP"),
                                  HasSubstr("  seeded ICP"), HasSubstr("  seeded ICP + graph"),
                                  HasSubstr("ATE (RMSE), m"), HasSubstr("slowest scan, ms")));
    for (const char* name : {"compare.png", "compare.txt", "compare.json", "plain_icp.tum",
                             "seeded_icp.tum", "seeded_icp_graph.tum"}) {
        EXPECT_GT(std::filesystem::file_size(folder / ("room_compare/" + std::string(name))), 0U);
    }
}

TEST(Compare, FiguresAreThoseOfTheTrajectories) {
    const TempFolder folder;
    simulate_room(folder);
    const Json json =
        run_well(folder, "compare room.clf --truth room.truth.tum --out there --json").json();
    ASSERT_EQ(json["variants"].size(), 3U);
    const Trajectory truth = read_tum(folder / "room.truth.tum");
    const char* files[] = {"plain_icp.tum", "seeded_icp.tum", "seeded_icp_graph.tum"};
    for (std::size_t i = 0; i < 3; ++i) {
        const TruthError error =
            truth_error(read_tum(folder / ("there/" + std::string(files[i]))), truth);
        EXPECT_NEAR(json["variants"][i]["error"]["ate_rmse_m"].get<double>(), error.ate_rmse, 1e-5);
    }
    EXPECT_EQ(json["variants"][0]["priors_used"].count("wheel"), 0U);
    EXPECT_EQ(json["variants"][1]["priors_used"]["wheel"], truth.size() - 1);
    EXPECT_EQ(json["variants"][1]["closures"]["accepted"], 0);
    EXPECT_GT(json["raw_odometry"]["ate_rmse_m"], json["variants"][2]["error"]["ate_rmse_m"]);
}

TEST(Compare, LastVariantIsWhatMapMakes) {
    const TempFolder folder;
    simulate_room(folder);
    run_well(folder, "compare room.clf --truth room.truth.tum --out there");
    run_well(folder, "map room.clf --out room");
    EXPECT_TRUE(same_bytes(folder / "there/seeded_icp_graph.tum", folder / "room/trajectory.tum"));
    run_well(folder,
             "map room.clf --out room --config '" HYBRID_SLAM_SOURCE_DIR "/config/plain_icp.yaml'");
    EXPECT_TRUE(same_bytes(folder / "there/plain_icp.tum", folder / "room/trajectory.tum"));
}

TEST(Compare, LogWithoutOdometryHasNoSuchColumn) {
    const TempFolder folder;
    write_room(folder);
    run_well(folder, "simulate room.yaml --out room.clf");
    // FLASER n ranges... then six numbers of the poses.
    const std::string blind_the_wheels =
        "awk '{n=$2; for(i=n+3;i<=n+8;i++) $i=0; print}' room.clf > blind.clf";
    ASSERT_EQ(std::system(("cd '" + folder.path().string() + "' && " + blind_the_wheels).c_str()),
              0);
    const Outcome result = run_well(folder, "compare blind.clf --truth room.truth.tum --out there");
    EXPECT_THAT(result.out, Not(HasSubstr("raw odometry")));
    const Json json = Json::parse(bytes_of(folder / "there/compare.json"));
    EXPECT_TRUE(json["raw_odometry"].is_null());
    EXPECT_EQ(json["variants"][1]["priors_used"].count("wheel"), 0U);
}

}  // namespace
}  // namespace hybrid_slam::test
