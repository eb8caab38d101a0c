// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/frame.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "hybrid_slam/core/source.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam {
namespace {

using test::PoseNear;

Scan scan_at(double stamp) {
    Scan scan;
    scan.stamp = stamp;
    scan.ranges = {1.0F, 2.0F};
    return scan;
}

Image image_at(double stamp) {
    Image image;
    image.stamp = stamp;
    return image;
}

VisualMotion motion_to(double stamp) {
    VisualMotion motion;
    motion.stamp = stamp;
    return motion;
}

std::optional<Pose2d> odometry_of(FrameAssembler& assembler, double stamp) {
    const auto frame = assembler.push(scan_at(stamp));
    return frame ? frame->odom_from_robot : std::nullopt;
}

/// Drives along x at 2 m/s with readings each 0.1 s from 10 s on.
void drive(FrameAssembler& assembler, int readings) {
    for (int i = 0; i < readings; ++i) {
        assembler.push(WheelOdometry{10.0 + 0.1 * i, Pose2d(0.2 * i, 0.0, 0.0)});
    }
}

TEST(FrameAssembler, OnlyAScanCompletesAFrame) {
    FrameAssembler assembler;
    EXPECT_FALSE(assembler.push(WheelOdometry{}).has_value());
    EXPECT_FALSE(assembler.push(image_at(1.0)).has_value());
    const auto frame = assembler.push(scan_at(2.0));
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->scan.stamp, 2.0);
    EXPECT_EQ(frame->scan.ranges.size(), 2U);
}

TEST(FrameAssembler, GivesTheVisualMotionsSinceTheFrameBefore) {
    FrameAssembler assembler;
    assembler.push(motion_to(1.0));
    assembler.push(motion_to(2.0));
    const auto first = assembler.push(scan_at(2.5));
    ASSERT_EQ(first->visual.size(), 2U);
    EXPECT_EQ(first->visual[1].stamp, 2.0);
    EXPECT_TRUE(assembler.push(scan_at(3.0))->visual.empty());
    assembler.push(motion_to(4.0));
    EXPECT_EQ(assembler.push(scan_at(5.0))->visual.size(), 1U);
    EXPECT_FALSE(assembler.flush().has_value());
}

TEST(FrameAssembler, KeepsTheNewestVisualMotionsWhileNoScanComes) {
    FrameAssembler assembler;
    const auto most = FrameAssembler::kMostVisual;
    for (std::size_t i = 0; i < most + 20; ++i) {
        assembler.push(motion_to(static_cast<double>(i)));
    }
    const auto frame = assembler.push(scan_at(1e4));
    ASSERT_EQ(frame->visual.size(), most);
    EXPECT_EQ(frame->visual.front().stamp, 20.0);
    EXPECT_EQ(frame->visual.back().stamp, static_cast<double>(most + 19));
}

TEST(FrameAssembler, AScanWaitsForTheImageAfterIt) {
    FrameAssembler assembler(0.2);
    EXPECT_TRUE(assembler.push(scan_at(1.0)).has_value());  // there is no image yet
    assembler.push(motion_to(1.95));
    EXPECT_FALSE(assembler.push(scan_at(2.0)).has_value());
    EXPECT_FALSE(assembler.push(motion_to(1.99)).has_value());
    const auto frame = assembler.push(motion_to(2.02));
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->scan.stamp, 2.0);
    EXPECT_EQ(frame->visual.size(), 3U);
    EXPECT_TRUE(assembler.push(scan_at(2.01)).has_value());  // the image after it was there before
    EXPECT_TRUE(assembler.push(scan_at(2.3)).has_value());   // images have stopped long ago
}

TEST(FrameAssembler, AScanWaitsNoLongerThanForTheNextScan) {
    FrameAssembler assembler(0.2);
    assembler.push(motion_to(1.95));
    EXPECT_FALSE(assembler.push(scan_at(2.0)).has_value());
    const auto first = assembler.push(scan_at(2.1));
    ASSERT_TRUE(first.has_value());
    EXPECT_EQ(first->scan.stamp, 2.0);
    const auto second = assembler.push(motion_to(2.15));
    ASSERT_TRUE(second.has_value());
    EXPECT_EQ(second->scan.stamp, 2.1);
    EXPECT_FALSE(assembler.push(scan_at(2.2)).has_value());
    EXPECT_EQ(assembler.flush()->scan.stamp, 2.2);
}

TEST(FrameAssembler, WithoutWheelsThereIsNoOdometry) {
    FrameAssembler assembler;
    EXPECT_FALSE(odometry_of(assembler, 1.0).has_value());
}

TEST(FrameAssembler, TakesTheReadingWithTheVeryStamp) {
    FrameAssembler assembler;
    assembler.push(WheelOdometry{10.0, Pose2d(1.0, 2.0, 3.0)});
    EXPECT_THAT(*odometry_of(assembler, 10.0), PoseNear(Pose2d(1.0, 2.0, 3.0), 0.0, 0.0));
    assembler.push(WheelOdometry{11.0, Pose2d(4.0, 5.0, 6.0)});
    EXPECT_THAT(*odometry_of(assembler, 10.0), PoseNear(Pose2d(1.0, 2.0, 3.0), 0.0, 0.0));
    EXPECT_THAT(*odometry_of(assembler, 11.0), PoseNear(Pose2d(4.0, 5.0, 6.0), 0.0, 0.0));
}

TEST(FrameAssembler, OneReadingWithAnotherStampIsNotEnough) {
    FrameAssembler assembler;
    assembler.push(WheelOdometry{10.0, Pose2d()});
    EXPECT_FALSE(odometry_of(assembler, 10.01).has_value());
}

TEST(FrameAssembler, InterpolatesAndExtrapolatesTheNewestTwo) {
    FrameAssembler assembler;
    drive(assembler, 6);
    EXPECT_THAT(*odometry_of(assembler, 10.45), PoseNear(Pose2d(0.9, 0.0, 0.0), 1e-9, 1e-9));
    EXPECT_THAT(*odometry_of(assembler, 10.6), PoseNear(Pose2d(1.2, 0.0, 0.0), 1e-9, 1e-9));
    EXPECT_THAT(*odometry_of(assembler, 10.35), PoseNear(Pose2d(0.7, 0.0, 0.0), 1e-9, 1e-9));
    EXPECT_THAT(*odometry_of(assembler, 10.999), PoseNear(Pose2d(1.998, 0.0, 0.0), 1e-9, 1e-9));
}

TEST(FrameAssembler, ExtrapolatesAlongTheArc) {
    FrameAssembler assembler;
    const Pose2d step = Pose2d::exp({0.1, 0.0, 0.2});
    assembler.push(WheelOdometry{1.0, Pose2d(5.0, 5.0, 3.0)});
    assembler.push(WheelOdometry{1.1, Pose2d(5.0, 5.0, 3.0) * step});
    EXPECT_THAT(*odometry_of(assembler, 1.2),
                PoseNear(Pose2d(5.0, 5.0, 3.0) * step * step, 1e-9, 1e-9));
}

TEST(FrameAssembler, DoesNotExtrapolateFar) {
    FrameAssembler assembler;
    drive(assembler, 6);
    EXPECT_FALSE(odometry_of(assembler, 10.5 + FrameAssembler::kMaxExtrapolation + 0.01));
    EXPECT_FALSE(odometry_of(assembler, 10.4 - FrameAssembler::kMaxExtrapolation - 0.01));
    EXPECT_FALSE(odometry_of(assembler, std::numeric_limits<double>::quiet_NaN()));
}

TEST(FrameAssembler, DoesNotTrustTheSpeedOfABurst) {
    FrameAssembler assembler;
    assembler.push(WheelOdometry{10.0, Pose2d(0.0, 0.0, 0.0)});
    assembler.push(WheelOdometry{10.0001, Pose2d(0.01, 0.0, 0.0)});  // 100 m/s
    EXPECT_FALSE(odometry_of(assembler, 10.3).has_value());
}

TEST(FrameAssembler, ARepeatedStampReplacesTheReading) {
    FrameAssembler assembler;
    drive(assembler, 2);
    assembler.push(WheelOdometry{10.1, Pose2d(0.4, 0.0, 0.0)});
    EXPECT_THAT(*odometry_of(assembler, 10.2), PoseNear(Pose2d(0.8, 0.0, 0.0), 1e-9, 1e-9));
}

TEST(FrameAssembler, SurvivesAClockThatRunsBackwards) {
    FrameAssembler assembler;
    drive(assembler, 6);
    assembler.push(WheelOdometry{3.0, Pose2d(7.0, 0.0, 0.0)});
    EXPECT_THAT(*odometry_of(assembler, 3.0), PoseNear(Pose2d(7.0, 0.0, 0.0), 0.0, 0.0));
    EXPECT_FALSE(odometry_of(assembler, 3.05).has_value());
    assembler.push(WheelOdometry{3.1, Pose2d(7.1, 0.0, 0.0)});
    EXPECT_THAT(*odometry_of(assembler, 3.2), PoseNear(Pose2d(7.2, 0.0, 0.0), 1e-9, 1e-9));
}

TEST(Scan, TellsReturnsFromTheRest) {
    Scan scan;
    scan.range_min = 0.1;
    scan.range_max = 80.0;
    for (const float good : {0.2F, 1.0F, 79.99F}) {
        EXPECT_TRUE(scan.is_return(good)) << good;
    }
    for (const float bad : {0.0F, -1.0F, 80.0F, 81.9F, HUGE_VALF, -HUGE_VALF, NAN}) {
        EXPECT_FALSE(scan.is_return(bad)) << bad;
    }
    scan.angle_min = -0.5 * kPi;
    scan.angle_increment = radians(1.0);
    EXPECT_NEAR(scan.angle(90), 0.0, 1e-12);
}

TEST(Source, OfUnknownLengthHasNoProgress) {
    struct Silent : Source {
        std::optional<Measurement> next() override { return std::nullopt; }
    };
    EXPECT_LT(Silent().progress(), 0.0);
}

}  // namespace
}  // namespace hybrid_slam
