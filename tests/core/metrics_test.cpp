// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/metrics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/points.hpp"
#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"
#include "support/shared_data.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using test::PoseNear;
using test::TempFolder;
using ::testing::HasSubstr;

TEST(Relations, ReadsLinesAsTheFilesHaveThem) {
    const TempFolder folder;
    const auto relations = read_relations(
        folder.write("r.relations",
                     "# comment\n\n1134864645.90321 1134864646.32420 0.31293 0.02935 0.00000  "
                     "0.00000 0.00000 0.24198\n2 1 1 -1 0 0 0 3.5\r\n"));
    ASSERT_EQ(relations.size(), 2U);
    EXPECT_EQ(relations[0].from_stamp, 1134864645.90321);
    EXPECT_EQ(relations[0].to_stamp, 1134864646.32420);
    EXPECT_THAT(relations[0].from_from_to, PoseNear(Pose2d(0.31293, 0.02935, 0.24198), 0.0, 0.0));
    EXPECT_THAT(relations[1].from_from_to,
                PoseNear(Pose2d(1.0, -1.0, 3.5 - 2.0 * kPi), 1e-12, 1e-12));
}

TEST(Relations, NamesTheLineThatIsWrong) {
    const TempFolder folder;
    for (const char* bad : {"1 2 3 4 5 6 7\n", "1 2 3 4 5 6 7 8 9\n", "1 2 3 4 5 6 7 nan\n"}) {
        const auto file = folder.write("r.relations", std::string("1 2 0 0 0 0 0 0\n") + bad);
        EXPECT_EQ(error_of([&] { read_relations(file); }),
                  file.string() + ":2: must be eight numbers: t1 t2 x y z roll pitch yaw");
    }
    EXPECT_THAT(error_of([&] { read_relations(folder.write("e.relations", "#\n")); }),
                HasSubstr("holds no relation"));
}

TEST(Relations, ReadsThePublishedFiles) {
    HYBRID_SLAM_SHARED_OR_SKIP(folder, "data/slam2d");
    EXPECT_EQ(read_relations(folder / "intel.relations").size(), 2984U);
    EXPECT_EQ(read_relations(folder / "fr079.relations").size(), 1685U);
    EXPECT_EQ(read_relations(folder / "mit-csail.relations").size(), 1172U);
}

TEST(RelationsError, AgreesWithHandComputedNumbers) {
    // From 1 to 2 the robot goes 2 m ahead and turns left by 90 degrees; from 2 to 3, 1 m ahead.
    const Trajectory trajectory{
        {1.0, {5.0, 5.0, 0.5 * kPi}}, {2.0, {5.0, 7.0, kPi}}, {3.0, {4.0, 7.0, kPi}}};
    const std::vector<Relation> relations{{1.0, 2.0, {2.0, 0.0, 0.5 * kPi}},        // no error
                                          {2.0005, 2.9995, {1.3, 0.4, 0.0}},        // 0.5 m
                                          {1.0, 2.0, {2.0, 0.0, 0.5 * kPi + 0.3}},  // 0.3 rad
                                          {1.0, 9.0, {0.0, 0.0, 0.0}}};  // no pose at 9 s
    const RelationsError error = relations_error(trajectory, relations);
    EXPECT_EQ(error.used, 3U);
    EXPECT_EQ(error.unmatched, 1U);
    EXPECT_NEAR(error.translation.mean, 0.5 / 3.0, 1e-12);
    EXPECT_NEAR(error.translation.deviation, 0.5 * std::sqrt(2.0) / 3.0, 1e-12);
    EXPECT_NEAR(error.translation.mean_squared, 0.25 / 3.0, 1e-12);
    EXPECT_NEAR(error.translation.deviation_squared, 0.25 * std::sqrt(2.0) / 3.0, 1e-12);
    EXPECT_NEAR(error.translation.maximum, 0.5, 1e-12);
    EXPECT_NEAR(error.rotation.mean, 0.1, 1e-12);
    EXPECT_NEAR(error.rotation.mean_squared, 0.03, 1e-12);
    EXPECT_NEAR(error.rotation.maximum, 0.3, 1e-12);
}

TEST(RelationsError, DoesNotDependOnTheFrameOfTheMap) {
    const std::vector<Relation> relations{{1.0, 2.0, {1.0, 0.5, 3.0}},
                                          {2.0, 1.0, {0.0, 1.0, -2.0}}};
    Trajectory trajectory{{1.0, {0.3, 0.2, 3.1}}, {2.0, {1.0, 1.0, -3.1}}};
    const RelationsError before = relations_error(trajectory, relations);
    for (StampedPose& pose : trajectory) {
        pose.pose = Pose2d(10.0, -20.0, 2.0) * pose.pose;
    }
    const RelationsError after = relations_error(trajectory, relations);
    EXPECT_GT(before.translation.mean, 0.1);
    EXPECT_NEAR(after.translation.mean, before.translation.mean, 1e-12);
    EXPECT_NEAR(after.rotation.mean, before.rotation.mean, 1e-12);
}

TEST(RelationsError, RotationErrorsAreWrapped) {
    const Trajectory trajectory{{1.0, {0.0, 0.0, 0.0}}, {2.0, {0.0, 0.0, radians(179.0)}}};
    const auto error = relations_error(trajectory, {{1.0, 2.0, {0.0, 0.0, radians(-179.0)}}});
    EXPECT_NEAR(error.rotation.mean, radians(2.0), 1e-12);
}

TEST(RelationsError, TheToleranceIsKept) {
    const Trajectory trajectory{{1.0, {}}, {2.0, {}}};
    const std::vector<Relation> relations{{1.0, 2.005, {}}};
    EXPECT_EQ(relations_error(trajectory, relations).unmatched, 1U);
    EXPECT_EQ(relations_error(trajectory, relations, 0.01).used, 1U);
}

TEST(RelationsError, OfNothingPassesNoLimit) {
    const RelationsError error = relations_error({}, {{1.0, 2.0, {}}});
    EXPECT_EQ(error.used, 0U);
    EXPECT_EQ(error.unmatched, 1U);
    EXPECT_FALSE(error.translation.mean < 1e9);
    EXPECT_FALSE(error.rotation.maximum < 1e9);
}

/// A winding drive at 1 m/s with a pose each 0.1 s.
Trajectory winding_drive(double seconds) {
    Trajectory trajectory;
    Pose2d pose(2.0, 3.0, 3.0);
    for (int i = 0; 0.1 * i < seconds; ++i) {
        trajectory.push_back({100.0 + 0.1 * i, pose});
        pose = pose * Pose2d::exp({0.1, 0.0, 0.1 * std::sin(0.07 * i)});
    }
    return trajectory;
}

TEST(TruthError, IsZeroUnderAKnownOffset) {
    const Trajectory truth = winding_drive(60.0);
    const Pose2d truth_from_estimate(10.0, -4.0, 2.5);
    Trajectory estimate;
    for (const StampedPose& pose : truth) {
        estimate.push_back({pose.stamp, truth_from_estimate.inverse() * pose.pose});
    }
    const TruthError error = truth_error(estimate, truth);
    EXPECT_EQ(error.used, truth.size());
    EXPECT_EQ(error.unmatched, 0U);
    EXPECT_THAT(error.truth_from_estimate, PoseNear(truth_from_estimate, 1e-9, 1e-10));
    EXPECT_GT(error.rpe_pairs, 500U);
    for (const double value :
         {error.ate_rmse, error.ate_max, error.x_rmse, error.y_rmse, error.heading_rmse,
          error.rpe_translation_rmse, error.rpe_rotation_rmse}) {
        EXPECT_NEAR(value, 0.0, 1e-9);
    }
}

TEST(TruthError, WithoutAlignmentTheOffsetIsTheError) {
    const Trajectory truth = winding_drive(10.0);
    Trajectory estimate = truth;
    for (StampedPose& pose : estimate) {
        pose.pose.translation += Point2(0.3, -0.4);
        pose.pose.heading = normalize_angle(pose.pose.heading + 0.1);
    }
    TruthOptions options;
    options.alignment = TruthAlignment::kNone;
    const TruthError error = truth_error(estimate, truth, options);
    EXPECT_NEAR(error.x_rmse, 0.3, 1e-12);
    EXPECT_NEAR(error.y_rmse, 0.4, 1e-12);
    EXPECT_NEAR(error.ate_rmse, 0.5, 1e-12);
    EXPECT_NEAR(error.ate_max, 0.5, 1e-12);
    EXPECT_NEAR(error.heading_rmse, 0.1, 1e-12);
    EXPECT_THAT(error.truth_from_estimate, PoseNear(Pose2d(), 0.0, 0.0));
}

TEST(TruthError, AnchoredAtTheFirstPoseItsHeadingCounts) {
    const Trajectory truth = winding_drive(10.0);
    Trajectory estimate;
    for (const StampedPose& pose : truth) {
        estimate.push_back({pose.stamp, between(truth.front().pose, pose.pose)});
    }
    TruthOptions options;
    options.alignment = TruthAlignment::kFirstPose;
    const TruthError exact = truth_error(estimate, truth, options);
    EXPECT_NEAR(exact.ate_max, 0.0, 1e-12);
    EXPECT_THAT(exact.truth_from_estimate, PoseNear(truth.front().pose, 1e-12, 1e-12));
    estimate.front().pose.heading += 0.01;
    const TruthError turned = truth_error(estimate, truth, options);
    EXPECT_GT(turned.ate_max, 0.03) << "a best fit would hide it";
    EXPECT_LT(truth_error(estimate, truth).ate_max, 1e-9);
}

TEST(TruthError, AgreesWithTheThesisFormulas) {
    const Trajectory truth{{1.0, {0.0, 0.0, kPi}}, {2.0, {1.0, 0.0, 0.0}}, {3.0, {2.0, 0.0, 0.0}}};
    const Trajectory estimate{
        {1.0, {0.1, 0.0, -kPi + 0.3}}, {2.0, {1.0, 0.2, 0.0}}, {3.0, {1.8, 0.1, 0.0}}};
    TruthOptions options;
    options.alignment = TruthAlignment::kNone;
    const TruthError error = truth_error(estimate, truth, options);
    EXPECT_NEAR(error.x_rmse, std::sqrt((0.01 + 0.0 + 0.04) / 3.0), 1e-12);
    EXPECT_NEAR(error.y_rmse, std::sqrt((0.0 + 0.04 + 0.01) / 3.0), 1e-12);
    EXPECT_NEAR(error.ate_rmse, std::sqrt(0.1 / 3.0), 1e-12);
    EXPECT_NEAR(error.ate_max, std::sqrt(0.05), 1e-12);
    EXPECT_NEAR(error.heading_rmse, 0.3 / std::sqrt(3.0), 1e-12);
}

TEST(TruthError, RelativeErrorOfAWrongScale) {
    Trajectory truth;
    Trajectory estimate;
    for (int i = 0; i <= 100; ++i) {
        truth.push_back({1.0 * i, {0.1 * i, 0.0, 0.0}});
        estimate.push_back({1.0 * i, {0.11 * i, 0.0, 0.0}});
    }
    TruthOptions options;
    options.rpe_distance = 2.0;
    const TruthError error = truth_error(estimate, truth, options);
    EXPECT_EQ(error.rpe_pairs, 81U);
    EXPECT_EQ(error.rpe_distance, 2.0);
    EXPECT_NEAR(error.rpe_translation_rmse, 0.2, 1e-9);
    EXPECT_NEAR(error.rpe_rotation_rmse, 0.0, 1e-12);
}

TEST(TruthError, RelativeErrorOfAHeadingDrift) {
    Trajectory truth;
    Trajectory estimate;
    for (int i = 0; i <= 100; ++i) {
        truth.push_back({1.0 * i, {0.1 * i, 0.0, 0.0}});
        estimate.push_back({1.0 * i, {0.1 * i, 0.0, 0.01 * i}});
    }
    EXPECT_NEAR(truth_error(estimate, truth).rpe_rotation_rmse, 0.1, 1e-9);
}

TEST(TruthError, AShortDriveHasNoRelativeError) {
    const TruthError error = truth_error(winding_drive(0.5), winding_drive(0.5));
    EXPECT_EQ(error.rpe_pairs, 0U);
    EXPECT_TRUE(std::isnan(error.rpe_translation_rmse));
}

TEST(TruthError, InterpolatesTheTruthButNotOverGaps) {
    Trajectory truth = winding_drive(20.0);
    Trajectory estimate;
    for (std::size_t i = 0; i + 1 < truth.size(); ++i) {
        estimate.push_back(
            {truth[i].stamp + 0.05, interpolate(truth[i].pose, truth[i + 1].pose, 0.5)});
    }
    const TruthError whole = truth_error(estimate, truth);
    EXPECT_EQ(whole.used, estimate.size());
    EXPECT_LT(whole.ate_rmse, 1e-6);
    truth.erase(truth.begin() + 50, truth.begin() + 60);
    const TruthError gap = truth_error(estimate, truth);
    EXPECT_EQ(gap.unmatched, 11U);
    EXPECT_LT(gap.ate_rmse, 1e-6);
}

TEST(TruthError, RefusesWhatCannotBeCompared) {
    const Trajectory truth = winding_drive(5.0);
    EXPECT_EQ(error_of([&] {
                  truth_error({{1.0, {}}, {100.0, {}}}, truth);
              }),
              "truth_error: only 1 of 2 estimated poses have truth at their stamp");
    TruthOptions options;
    options.rpe_distance = 0.0;
    EXPECT_THROW(truth_error(truth, truth, options), Error);
}

}  // namespace
}  // namespace hybrid_slam
