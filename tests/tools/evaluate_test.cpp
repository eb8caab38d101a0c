// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "hybrid_slam/core/metrics.hpp"
#include "running.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

/// A walk along x with a step to the side and a last pose beyond the truth.
void write_walk(const TempFolder& folder) {
    Trajectory truth;
    Trajectory estimate;
    for (int i = 0; i < 40; ++i) {
        truth.push_back({0.1 * i, Pose2d(0.1 * i, 0.0, 0.0)});
        estimate.push_back({0.1 * i, Pose2d(0.1 * i, i < 20 ? 0.0 : 0.2, 0.01 * i)});
    }
    estimate.push_back({99.0, Pose2d(4.0, 0.0, 0.0)});
    write_tum(folder / "truth.tum", truth);
    write_tum(folder / "walk.tum", estimate);
    folder.write("walk.relations",
                 "0.0 1.0 1.0 0 0 0 0 0\n1.0 2.5 1.5 0 0 0 0 0\n1.0 50.0 9 0 0 0 0 0\n");
}

TEST(Evaluate, NumbersAgainstTruthAreTheLibrarys) {
    const TempFolder folder;
    write_walk(folder);
    const Json json = run_well(folder, "evaluate walk.tum --truth truth.tum --json").json();
    const TruthError error =
        truth_error(read_tum(folder / "walk.tum"), read_tum(folder / "truth.tum"));
    EXPECT_EQ(json["used"], 40);
    EXPECT_EQ(json["unmatched"], 1);
    EXPECT_DOUBLE_EQ(json["ate_rmse_m"].get<double>(), error.ate_rmse);
    EXPECT_DOUBLE_EQ(json["ate_max_m"].get<double>(), error.ate_max);
    EXPECT_DOUBLE_EQ(json["x_rmse_m"].get<double>(), error.x_rmse);
    EXPECT_DOUBLE_EQ(json["y_rmse_m"].get<double>(), error.y_rmse);
    EXPECT_DOUBLE_EQ(json["heading_rmse_deg"].get<double>(), degrees(error.heading_rmse));
    EXPECT_DOUBLE_EQ(json["rpe_translation_rmse_m"].get<double>(), error.rpe_translation_rmse);
}

TEST(Evaluate, NumbersAgainstRelationsAreTheLibrarys) {
    const TempFolder folder;
    write_walk(folder);
    const Json json =
        run_well(folder, "evaluate walk.tum --relations walk.relations --json").json();
    const RelationsError error =
        relations_error(read_tum(folder / "walk.tum"), read_relations(folder / "walk.relations"));
    EXPECT_EQ(json["used"], 2);
    EXPECT_EQ(json["unmatched"], 1);
    EXPECT_DOUBLE_EQ(json["translation"]["mean_m"].get<double>(), error.translation.mean);
    EXPECT_DOUBLE_EQ(json["translation"]["deviation_m"].get<double>(), error.translation.deviation);
    EXPECT_DOUBLE_EQ(json["translation"]["mean_squared_m2"].get<double>(),
                     error.translation.mean_squared);
    EXPECT_DOUBLE_EQ(json["rotation"]["mean_deg"].get<double>(), degrees(error.rotation.mean));
    EXPECT_DOUBLE_EQ(json["rotation"]["mean_squared_deg2"].get<double>(),
                     degrees(degrees(error.rotation.mean_squared)));
    EXPECT_DOUBLE_EQ(json["rotation"]["max_deg"].get<double>(), degrees(error.rotation.maximum));
}

TEST(Evaluate, TextTellsWhatWasLeftOut) {
    const TempFolder folder;
    write_walk(folder);
    EXPECT_THAT(run_well(folder, "evaluate walk.tum --truth truth.tum").out,
                HasSubstr("40 poses used, 1 without truth"));
    EXPECT_THAT(run_well(folder, "evaluate walk.tum --relations walk.relations").out,
                HasSubstr("2 relations used, 1 without a pose"));
}

TEST(Evaluate, PlotsTheErrors) {
    const TempFolder folder;
    write_walk(folder);
    run_well(folder, "evaluate walk.tum --truth truth.tum --plot truth.png");
    run_well(folder, "evaluate walk.tum --relations walk.relations --plot relations.png");
    EXPECT_THAT(bytes_of(folder / "truth.png"), StartsWith("\x89PNG"));
    EXPECT_THAT(bytes_of(folder / "relations.png"), StartsWith("\x89PNG"));
    const Outcome result =
        run(folder, "evaluate walk.tum --truth truth.tum --plot nowhere/error.png");
    EXPECT_EQ(result.code, 1);
    EXPECT_THAT(result.err, HasSubstr("nowhere/error.png"));
}

TEST(Evaluate, BrokenTrajectoryNamesTheLine) {
    const TempFolder folder;
    write_walk(folder);
    folder.write("broken.tum", "0 0 0 0 0 0 0 1\n1 2 3\n");
    const Outcome result = run(folder, "evaluate broken.tum --truth truth.tum");
    EXPECT_EQ(result.code, 1);
    EXPECT_THAT(result.err, StartsWith("hybrid-slam: broken.tum:2: "));
}

}  // namespace
}  // namespace hybrid_slam::test
