// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "rendered_ride.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

CameraMounting level_camera(double ahead) {
    CameraMounting mounting;
    mounting.x = ahead;
    mounting.z = 1.0;
    mounting.pitch = 0.0;
    return mounting;
}

/// The line is put so low that there is nothing but floor below it.
VisualOdometry thesis(const CameraMounting& mounting, double line = 0.75) {
    VisualOdometryConfig config;
    config.method = VisualMethod::kThesis;
    config.thesis_line = line;
    return {CameraModel(), mounting, config};
}

World long_room() {
    World world;
    add_outline(world, {{-2.0, -5.0}, {16.0, -5.0}, {16.0, 5.0}, {-2.0, 5.0}});
    return world;
}

void expect_all_good(const std::vector<VisualMotion>& motions) {
    EXPECT_EQ(motions.front().status, VisualStatus::kFirst);
    for (std::size_t i = 1; i < motions.size(); ++i) {
        ASSERT_EQ(motions[i].status, VisualStatus::kGood) << i;
        ASSERT_EQ(motions[i].from_stamp, motions[i - 1].stamp);
        ASSERT_GT(motions[i].covariance.diagonal().minCoeff(), 0.0);
    }
}

// Equations 3.1 and 3.2 are exact for a level camera that turns about itself.
TEST(ThesisTracker, TurnsOnTheSpotAsItsSkyDoes) {
    for (const double rate : {0.5, -0.5}) {
        const Ride turn =
            ride(long_room(), level_camera(0.0), {2.0, 0.0, 0.0}, {0.0, 0.0, rate}, 10);
        VisualOdometry odometry = thesis(level_camera(0.0));
        const auto motions = track_all(odometry, turn);
        expect_all_good(motions);
        const Pose2d moved = sum_of(motions);
        EXPECT_NEAR(moved.heading, 0.15 * rate / 0.5, radians(0.5)) << "to the left is positive";
        EXPECT_LT(moved.translation.norm(), 0.03);
    }
}

// Equations 3.3 to 3.5: the floor in the bird's eye view.
TEST(ThesisTracker, DrivesStraightAsItsGroundDoes) {
    const Ride straight =
        ride(long_room(), level_camera(0.0), {0.0, 0.0, 0.0}, {0.9, 0.0, 0.0}, 10);
    VisualOdometry odometry = thesis(level_camera(0.0));
    const auto motions = track_all(odometry, straight);
    expect_all_good(motions);
    const Pose2d moved = sum_of(motions);
    EXPECT_NEAR(moved.x(), 0.27, 0.04);
    EXPECT_NEAR(moved.y(), 0.0, 0.03);
    EXPECT_NEAR(moved.heading, 0.0, radians(1.0));
}

TEST(ThesisTracker, ACameraAheadOfTheAxleMakesATurnLookSideways) {
    const Ride turn = ride(long_room(), level_camera(1.2), {2.0, 0.0, 0.0}, {0.0, 0.0, 0.5}, 7);
    VisualOdometry odometry = thesis(level_camera(1.2));
    const auto motions = track_all(odometry, turn);
    expect_all_good(motions);
    // The sky is not at infinity either, so that part of the way goes into the heading.
    const double angle = turn.moved().heading;
    EXPECT_NEAR(sum_of(motions).heading, angle, radians(1.0));
    EXPECT_GT(sum_of(motions).y(), 0.5 * 1.2 * angle);
    EXPECT_LT(sum_of(motions).y(), 1.5 * 1.2 * angle);
}

TEST(ThesisTracker, DividesSkyFromGroundAtItsLine) {
    const Ride straight = ride(long_room(), level_camera(0.0), {0.0, 0.0, 0.0}, {0.9, 0.0, 0.0}, 2);
    VisualOdometry odometry = thesis(level_camera(0.0), 0.6);
    track_all(odometry, straight);
    ASSERT_GE(odometry.features().size(), 50U);
    for (const auto& feature : odometry.features()) {
        EXPECT_EQ(feature.floor, feature.before.y() > 0.6 * 480);
    }
}

TEST(ThesisTracker, SaysWhenThereIsTooLittleToFollow) {
    Ride straight = ride(long_room(), level_camera(0.0), {0.0, 0.0, 0.0}, {0.9, 0.0, 0.0}, 6);
    for (const std::size_t i : {2, 3}) {
        std::fill(straight.images[i].pixels.begin(), straight.images[i].pixels.end(), 0);
    }
    VisualOdometry odometry = thesis(level_camera(0.0));
    const auto motions = track_all(odometry, straight);
    EXPECT_EQ(motions[1].status, VisualStatus::kGood);
    EXPECT_FALSE(motions[2].usable());
    EXPECT_FALSE(motions[3].usable());
    EXPECT_EQ(motions[5].status, VisualStatus::kGood);
}

}  // namespace
}  // namespace hybrid_slam::test
