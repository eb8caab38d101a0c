// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/odometry/visual_track.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

constexpr double kInterval = 1.0 / 32.0;  ///< seconds between images, exact in binary
const Eigen::Vector3d kTwist(0.8, 0.05, 0.6);

VisualMotion motion_of(double from, double to, const Eigen::Vector3d& twist = kTwist) {
    VisualMotion motion;
    motion.from_stamp = from;
    motion.stamp = to;
    motion.before_from_now = Pose2d::exp((to - from) * twist);
    motion.covariance = Eigen::Vector3d(4e-6, 1e-6, 1e-6).asDiagonal();
    motion.status = VisualStatus::kGood;
    return motion;
}

VisualMotion unusable(double from, double to) {
    VisualMotion motion;
    motion.from_stamp = from;
    motion.stamp = to;
    motion.status = VisualStatus::kTooDark;
    return motion;
}

/// Image i is at i * kInterval; along one arc.
VisualTrack arc(int images) {
    VisualTrack track;
    for (int i = 1; i < images; ++i) {
        track.add(motion_of((i - 1) * kInterval, i * kInterval));
    }
    return track;
}

double at(double images) {
    return images * kInterval;
}

Pose2d along(double images) {
    return Pose2d::exp(at(images) * kTwist);
}

TEST(VisualTrack, FollowsAnArcFromAnywhereToAnywhere) {
    const VisualTrack track = arc(33);
    const double places[][2] = {{0.0, 32.0}, {3.0, 4.0}, {3.25, 3.5},
                                {2.7, 9.1},  {0.0, 0.5}, {30.5, 32.0}};
    for (const auto& [from, to] : places) {
        const auto motion = track.between(at(from), at(to), 0.0);
        ASSERT_TRUE(motion.has_value()) << from << " to " << to;
        EXPECT_THAT(motion->from_from_to, PoseNear(along(to - from), 1e-12, 1e-12));
        EXPECT_LT((motion->twist - kTwist).norm(), 1e-9);
    }
}

TEST(VisualTrack, PutsDifferentMotionsOneAfterTheOther) {
    VisualTrack track;
    const Eigen::Vector3d turn(0.0, 0.0, 2.0);
    track.add(motion_of(0.0, 1.0));
    track.add(motion_of(1.0, 3.0, turn));
    track.add(motion_of(3.0, 4.0));
    const auto motion = track.between(0.5, 3.5, 0.0);
    ASSERT_TRUE(motion.has_value());
    EXPECT_THAT(motion->from_from_to, PoseNear(Pose2d::exp(0.5 * kTwist) * Pose2d::exp(2.0 * turn) *
                                                   Pose2d::exp(0.5 * kTwist),
                                               1e-12, 1e-12));
}

TEST(VisualTrack, ItsPartsMakeTheWhole) {
    const VisualTrack track = arc(20);
    const auto whole = track.between(at(1.3), at(15.8), 0.0);
    const auto first = track.between(at(1.3), at(7.6), 0.0);
    const auto second = track.between(at(7.6), at(15.8), 0.0);
    EXPECT_THAT(first->from_from_to * second->from_from_to,
                PoseNear(whole->from_from_to, 1e-12, 1e-12));
}

TEST(VisualTrack, NoWayNoMotion) {
    EXPECT_FALSE(VisualTrack().between(0.0, 1.0, 10.0).has_value());
    EXPECT_FALSE(VisualTrack().newest().has_value());
    const VisualTrack track = arc(10);
    EXPECT_FALSE(track.between(at(3), at(3), 1.0).has_value());
    EXPECT_FALSE(track.between(at(4), at(3), 1.0).has_value());
    EXPECT_FALSE(track.between(at(-0.5), at(3), 1.0).has_value()) << "before the first image";
}

TEST(VisualTrack, GoesOnBeyondTheNewestImageForAsLongAsAllowed) {
    const VisualTrack track = arc(17);
    const auto motion = track.between(at(12), at(20), 0.2);
    ASSERT_TRUE(motion.has_value());
    EXPECT_THAT(motion->from_from_to, PoseNear(along(8.0), 1e-9, 1e-9));
    EXPECT_LT((motion->twist - kTwist).norm(), 1e-9);
    EXPECT_TRUE(track.between(at(12), at(16) + 0.2, 0.2 + 1e-9).has_value());
    EXPECT_FALSE(track.between(at(12), at(16) + 0.21, 0.2).has_value());
    EXPECT_FALSE(track.between(at(12), at(17), 0.0).has_value());
}

TEST(VisualTrack, GoesOnWhenTheWholeWayLiesBeyondTheNewestImage) {
    const VisualTrack track = arc(17);
    const auto motion = track.between(at(17), at(19), 0.2);
    ASSERT_TRUE(motion.has_value());
    EXPECT_THAT(motion->from_from_to, PoseNear(along(2.0), 1e-9, 1e-9));
}

TEST(VisualTrack, CovarianceGrowsWithTheWayAndMoreSoUnseen) {
    const VisualTrack track = arc(17);
    const auto one = track.between(at(3), at(4), 0.0);
    EXPECT_LT((one->covariance - motion_of(0, 1).covariance).norm(), 1e-18) << "a step is itself";
    const auto half = track.between(at(3), at(3.5), 0.0);
    EXPECT_NEAR(half->covariance(2, 2), 0.5e-6, 1e-18);
    double before = 0.0;
    for (double to = 3.5; to < 16.0; to += 0.5) {
        const double now = track.between(at(3), at(to), 0.0)->covariance.trace();
        EXPECT_GT(now, before);
        before = now;
    }
    // Twelve errors of heading add up; each swings what is driven after it.
    const auto far = track.between(at(4), at(16), 0.0);
    EXPECT_NEAR(far->covariance(2, 2), 12e-6, 1e-15);
    EXPECT_GT(far->covariance(0, 0) + far->covariance(1, 1), 12 * 5e-6);
    const auto seen = track.between(at(4), at(16), 0.0);
    const auto a_bit = track.between(at(4), at(17), 1.0);
    const auto more = track.between(at(4), at(22), 1.0);
    EXPECT_GT(a_bit->covariance.trace(), seen->covariance.trace());
    EXPECT_GT(more->covariance.trace(), 2.0 * a_bit->covariance.trace());
    for (const auto& motion : {seen, a_bit, more}) {
        EXPECT_TRUE(motion->covariance.isApprox(motion->covariance.transpose()));
        EXPECT_GT(motion->covariance.determinant(), 0.0);
    }
}

TEST(VisualTrack, AStepThatWasNotSeenIsAGap) {
    VisualTrack track = arc(6);
    track.add(unusable(at(5), at(6)));
    EXPECT_FALSE(track.between(at(4), at(5.5), 1.0).has_value());
    EXPECT_FALSE(track.between(at(4), at(7), 1.0).has_value()) << "nor is there a way beyond it";
    VisualMotion first;  // the first image after a dark one
    first.from_stamp = first.stamp = at(7);
    track.add(first);
    for (int i = 8; i < 16; ++i) {
        track.add(motion_of(at(i - 1), at(i)));
    }
    EXPECT_FALSE(track.between(at(4.5), at(9), 0.0).has_value());
    EXPECT_FALSE(track.between(at(5.5), at(9), 0.0).has_value());
    EXPECT_FALSE(track.between(at(6.5), at(9), 0.0).has_value());
    for (const auto& [from, to] :
         {std::pair{3.0, 5.0}, std::pair{7.0, 9.0}, std::pair{9.5, 15.0}}) {
        const auto motion = track.between(at(from), at(to), 0.0);
        ASSERT_TRUE(motion.has_value()) << from;
        EXPECT_THAT(motion->from_from_to, PoseNear(along(to - from), 1e-12, 1e-12));
    }
}

TEST(VisualTrack, MissingImagesAreAGap) {
    VisualTrack track = arc(6);
    for (int i = 9; i < 16; ++i) {
        track.add(motion_of(at(i - 1), at(i)));
    }
    EXPECT_FALSE(track.between(at(4), at(9), 1.0).has_value());
    EXPECT_FALSE(track.between(at(5), at(8), 1.0).has_value());
    EXPECT_TRUE(track.between(at(8), at(10), 1.0).has_value());
    EXPECT_TRUE(track.between(at(3), at(5), 1.0).has_value());
}

TEST(VisualTrack, WhatWasSeenStaysSeenWhenTheNewestImageIsNoGood) {
    VisualTrack track = arc(6);
    track.add(unusable(at(5), at(6)));
    const auto motion = track.between(at(2), at(4.5), 0.0);
    ASSERT_TRUE(motion.has_value());
    EXPECT_THAT(motion->from_from_to, PoseNear(along(2.5), 1e-12, 1e-12));
    EXPECT_LT((motion->twist - kTwist).norm(), 1e-9);
}

TEST(VisualTrack, HiddenGroundIsUsedWithItsCovariance) {
    VisualTrack track;
    VisualMotion motion = motion_of(0.0, 1.0);
    motion.status = VisualStatus::kGroundHidden;
    motion.covariance(0, 0) = 1.0;
    track.add(motion);
    EXPECT_EQ(track.between(0.0, 1.0, 0.0)->covariance(0, 0), 1.0);
}

TEST(VisualTrack, TheTwistIsThatOfTheEnd) {
    VisualTrack track;
    const Eigen::Vector3d later(0.2, 0.0, -0.9);
    for (int i = 1; i <= 32; ++i) {
        track.add(motion_of(at(i - 1), at(i), i <= 16 ? kTwist : later));
    }
    EXPECT_LT((track.between(at(1), at(8), 0.0)->twist - kTwist).norm(), 1e-9);
    EXPECT_LT((track.between(at(1), at(30), 0.0)->twist - later).norm(), 1e-9);
    EXPECT_LT((track.between(at(31), at(34), 1.0)->twist - later).norm(), 1e-9);
}

TEST(VisualTrack, ForgetsWhatLiesBehind) {
    VisualTrack track = arc(33);
    track.forget_before(at(20));
    EXPECT_TRUE(track.between(at(20), at(31.5), 0.0).has_value());
    EXPECT_LT((track.between(at(20), at(20.5), 0.0)->twist - kTwist).norm(), 1e-9);
    EXPECT_FALSE(track.between(at(2), at(31), 0.0).has_value());
    EXPECT_EQ(track.newest(), at(32));
}

TEST(VisualTrack, RemembersWhenTheCameraFellSilent) {
    VisualTrack track = arc(6);
    track.forget_before(at(100));
    EXPECT_FALSE(track.between(at(100), at(101), 1.0).has_value());
    ASSERT_TRUE(track.newest().has_value()) << "there was an image";
    EXPECT_EQ(*track.newest(), at(5));
    track.add(unusable(at(5), at(101)));
    EXPECT_EQ(*track.newest(), at(101)) << "usable or not";
}

}  // namespace
}  // namespace hybrid_slam::test
