// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/odometry/motion_prior.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

MotionPriorConfig config_of(PriorKind kind) {
    MotionPriorConfig config;
    config.kind = kind;
    config.max_gap = 1.0;
    config.wheel_translation_floor = 0.01;
    config.wheel_translation_ratio = 0.1;
    config.wheel_rotation_floor = 0.02;
    config.wheel_rotation_ratio = 0.2;
    config.velocity_translation_floor = 0.05;
    config.velocity_translation_ratio = 0.5;
    config.velocity_rotation_floor = 0.06;
    config.velocity_rotation_ratio = 0.7;
    return config;
}

Frame frame_at(double stamp) {
    Frame frame;
    frame.scan.stamp = stamp;
    return frame;
}
Frame frame_at(double stamp, const Pose2d& odom_from_robot) {
    Frame frame = frame_at(stamp);
    frame.odom_from_robot = odom_from_robot;
    return frame;
}

void expect_nothing(const MotionPrior& prior) {
    EXPECT_EQ(prior.used, PriorKind::kNone);
    EXPECT_THAT(prior.before_from_now, PoseNear(Pose2d(), 0.0, 0.0));
    EXPECT_TRUE(prior.information.isZero(0.0));
}

const Pose2d kStep(0.2, 0.01, 0.1);

TEST(MotionPrior, NoneNeverSaysAnything) {
    MotionPredictor predictor(config_of(PriorKind::kNone));
    expect_nothing(predictor.predict(frame_at(0.0, kStep)));
    predictor.update(frame_at(0.0, {}), {});
    predictor.update(frame_at(0.1, kStep), kStep);
    expect_nothing(predictor.predict(frame_at(0.2, kStep * kStep)));
    EXPECT_TRUE(predictor.alternatives(frame_at(0.2, kStep * kStep), {}).empty());
}

TEST(MotionPrior, VelocityGoesOnAlongItsArc) {
    MotionPredictor predictor(config_of(PriorKind::kConstantVelocity));
    expect_nothing(predictor.predict(frame_at(0.0)));
    predictor.update(frame_at(0.0), {});
    expect_nothing(predictor.predict(frame_at(0.1)));
    predictor.update(frame_at(0.1), kStep);
    const MotionPrior same = predictor.predict(frame_at(0.2));
    EXPECT_EQ(same.used, PriorKind::kConstantVelocity);
    EXPECT_THAT(same.before_from_now, PoseNear(kStep, 1e-12, 1e-12));
    EXPECT_THAT(predictor.predict(frame_at(0.3)).before_from_now,
                PoseNear(kStep * kStep, 1e-12, 1e-12))
        << "twice the time, twice along the same arc";
    EXPECT_THAT(predictor.predict(frame_at(0.15)).before_from_now,
                PoseNear(interpolate({}, kStep, 0.5), 1e-12, 1e-12));
}

TEST(MotionPrior, VelocityIgnoresTheWheels) {
    MotionPredictor predictor(config_of(PriorKind::kConstantVelocity));
    predictor.update(frame_at(0.0, {}), {});
    predictor.update(frame_at(0.1, {5.0, 0.0, 0.0}), kStep);
    EXPECT_THAT(predictor.predict(frame_at(0.2, {10.0, 0.0, 0.0})).before_from_now,
                PoseNear(kStep, 1e-12, 1e-12));
}

TEST(MotionPrior, VelocityHasItsSigmas) {
    MotionPredictor predictor(config_of(PriorKind::kConstantVelocity));
    predictor.update(frame_at(0.0), {});
    predictor.update(frame_at(0.1), {0.3, 0.4, -0.1});
    const MotionPrior prior = predictor.predict(frame_at(0.2));
    EXPECT_NEAR(prior.information(0, 0), std::pow(0.05 + 0.5 * 0.5, -2), 1e-6);
    EXPECT_NEAR(prior.information(1, 1), std::pow(0.05 + 0.5 * 0.5, -2), 1e-6);
    EXPECT_NEAR(prior.information(2, 2), std::pow(0.06 + 0.7 * 0.1, -2), 1e-6);
}

TEST(MotionPrior, WheelsSayTheMotionInTheRobotsAxes) {
    MotionPredictor predictor(config_of(PriorKind::kWheel));
    const Pose2d odom(3.0, -7.0, 3.1);
    expect_nothing(predictor.predict(frame_at(0.0, odom)));
    predictor.update(frame_at(0.0, odom), {});
    const MotionPrior prior = predictor.predict(frame_at(0.1, odom * kStep));
    EXPECT_EQ(prior.used, PriorKind::kWheel);
    EXPECT_THAT(prior.before_from_now, PoseNear(kStep, 1e-12, 1e-12));
    EXPECT_NEAR(prior.information(0, 0), std::pow(0.01 + 0.1 * kStep.translation.norm(), -2), 1e-6);
    EXPECT_NEAR(prior.information(2, 2), std::pow(0.02 + 0.2 * 0.1, -2), 1e-6);
}

TEST(MotionPrior, WheelsCountFromTheFrameBeforeWhateverTheScanFound) {
    MotionPredictor predictor(config_of(PriorKind::kWheel));
    predictor.update(frame_at(0.0, {}), {});
    predictor.update(frame_at(0.1, {1.0, 0.0, 0.0}), {0.2, 0.0, 0.0});
    EXPECT_THAT(predictor.predict(frame_at(0.2, {1.5, 0.0, 0.0})).before_from_now,
                PoseNear(Pose2d(0.5, 0.0, 0.0), 1e-12, 1e-12));
}

TEST(MotionPrior, WithoutWheelsTheVelocityStepsInAndSaysSo) {
    MotionPredictor predictor(config_of(PriorKind::kWheel));
    predictor.update(frame_at(0.0, {}), {});
    predictor.update(frame_at(0.1, kStep), kStep);
    const MotionPrior missing = predictor.predict(frame_at(0.2));
    EXPECT_EQ(missing.used, PriorKind::kConstantVelocity);
    EXPECT_THAT(missing.before_from_now, PoseNear(kStep, 1e-12, 1e-12));
    // The first frame with wheels after one without: what they count since then is not known.
    predictor.update(frame_at(0.2), kStep);
    EXPECT_EQ(predictor.predict(frame_at(0.3, {9.0, 9.0, 1.0})).used, PriorKind::kConstantVelocity);
    predictor.update(frame_at(0.3, {9.0, 9.0, 1.0}), kStep);
    EXPECT_EQ(predictor.predict(frame_at(0.4, {9.1, 9.0, 1.0})).used, PriorKind::kWheel);
}

TEST(MotionPrior, WheelsBridgeGapsThatVelocityDoesNot) {
    MotionPredictor predictor(config_of(PriorKind::kWheel));
    predictor.update(frame_at(0.0, {}), {});
    predictor.update(frame_at(0.1, kStep), kStep);
    EXPECT_EQ(predictor.predict(frame_at(60.0, kStep * kStep)).used, PriorKind::kWheel);
    expect_nothing(predictor.predict(frame_at(60.0)));
    EXPECT_EQ(predictor.predict(frame_at(1.09)).used, PriorKind::kConstantVelocity);
    expect_nothing(predictor.predict(frame_at(1.2)));
}

TEST(MotionPrior, AVelocityFromAcrossAGapIsForgotten) {
    MotionPredictor predictor(config_of(PriorKind::kConstantVelocity));
    predictor.update(frame_at(0.0), {});
    predictor.update(frame_at(0.1), kStep);
    predictor.update(frame_at(30.0), {8.0, 0.0, 0.0});
    expect_nothing(predictor.predict(frame_at(30.1)));
    predictor.update(frame_at(30.1), kStep);
    EXPECT_THAT(predictor.predict(frame_at(30.2)).before_from_now, PoseNear(kStep, 1e-12, 1e-12));
}

TEST(MotionPrior, StampsThatRepeatOrRunBackwardsGiveNoVelocity) {
    MotionPredictor predictor(config_of(PriorKind::kConstantVelocity));
    predictor.update(frame_at(10.0), {});
    predictor.update(frame_at(10.1), kStep);
    expect_nothing(predictor.predict(frame_at(9.0)));
    // Whatever moved between equal stamps, or back in time, is no velocity.
    predictor.update(frame_at(10.1), {0.5, 0.0, 0.0});
    EXPECT_THAT(predictor.predict(frame_at(10.2)).before_from_now, PoseNear(kStep, 1e-12, 1e-12));
    predictor.update(frame_at(9.0), {0.5, 0.0, 0.0});
    const MotionPrior after = predictor.predict(frame_at(9.1));
    EXPECT_TRUE(after.before_from_now.vector().allFinite());
    EXPECT_LT(after.before_from_now.translation.norm(), 0.3) << "not 0.5 m in -1.1 s";
    predictor.update(frame_at(9.1), {0.1, 0.0, 0.0});
    EXPECT_THAT(predictor.predict(frame_at(9.2)).before_from_now,
                PoseNear(Pose2d(0.1, 0.0, 0.0), 1e-12, 1e-12));
}

TEST(MotionPrior, EqualStampsPredictNoMotion) {
    MotionPredictor predictor(config_of(PriorKind::kConstantVelocity));
    predictor.update(frame_at(0.0), {});
    predictor.update(frame_at(0.1), kStep);
    const MotionPrior prior = predictor.predict(frame_at(0.1));
    EXPECT_THAT(prior.before_from_now, PoseNear(Pose2d(), 1e-12, 1e-12));
    EXPECT_TRUE(prior.information.allFinite());
}

TEST(MotionPrior, AlternativesStartElsewhereAndWeighNothing) {
    MotionPredictor predictor(config_of(PriorKind::kWheel));
    predictor.update(frame_at(0.0, {}), {});
    predictor.update(frame_at(0.1, {}), kStep);  // the wheels stood still
    const Frame frame = frame_at(0.2, {-0.3, 0.0, 0.0});
    const auto starts = predictor.alternatives(frame, predictor.predict(frame));
    ASSERT_EQ(starts.size(), 3U);
    EXPECT_EQ(starts[0].used, PriorKind::kWheel);
    EXPECT_THAT(starts[0].before_from_now, PoseNear(Pose2d(-0.3, 0.0, 0.0), 1e-12, 1e-12));
    EXPECT_EQ(starts[1].used, PriorKind::kConstantVelocity);
    EXPECT_THAT(starts[1].before_from_now, PoseNear(kStep, 1e-12, 1e-12));
    EXPECT_EQ(starts[2].used, PriorKind::kNone);
    EXPECT_THAT(starts[2].before_from_now, PoseNear(Pose2d(), 0.0, 0.0));
    for (const MotionPrior& start : starts) {
        EXPECT_TRUE(start.information.isZero(0.0));
    }
}

// ---- visual odometry ----

const Eigen::Vector3d kTwist(0.7, 0.02, 0.4);

/// Adds the motions of images each 25 ms along one arc, the last at `newest`.
void add_images(Frame& frame, double oldest, double newest) {
    constexpr double kInterval = 0.025;
    const auto count = std::lround((newest - oldest) / kInterval);
    for (long i = 0; i < count; ++i) {
        VisualMotion motion;
        motion.from_stamp = oldest + static_cast<double>(i) * kInterval;
        motion.stamp = oldest + static_cast<double>(i + 1) * kInterval;
        motion.before_from_now = Pose2d::exp((motion.stamp - motion.from_stamp) * kTwist);
        motion.covariance = 1e-6 * Eigen::Matrix3d::Identity();
        motion.status = VisualStatus::kGood;
        frame.visual.push_back(motion);
    }
}

TEST(MotionPrior, ImagesSayTheMotionBetweenTheScans) {
    MotionPredictor predictor(config_of(PriorKind::kVisual));
    Frame first = frame_at(0.1, Pose2d());
    add_images(first, 0.0, 0.1);
    expect_nothing(predictor.predict(first));
    predictor.update(first, {});
    Frame second = frame_at(0.215, kStep);  // between two images
    add_images(second, 0.1, 0.225);
    const MotionPrior prior = predictor.predict(second);
    EXPECT_EQ(prior.used, PriorKind::kVisual);
    EXPECT_THAT(prior.before_from_now, PoseNear(Pose2d::exp(0.115 * kTwist), 1e-9, 1e-9));
    EXPECT_LT((prior.twist - kTwist).norm(), 1e-6);
    EXPECT_NEAR(prior.information(2, 2), 1e6 / 4.6, 1e4) << "of 4.6 steps";
    predictor.update(second, prior.before_from_now);
    Frame third = frame_at(0.3);
    add_images(third, 0.225, 0.275);
    const MotionPrior carried = predictor.predict(third);
    EXPECT_EQ(carried.used, PriorKind::kVisual);
    EXPECT_THAT(carried.before_from_now, PoseNear(Pose2d::exp(0.085 * kTwist), 1e-9, 1e-9));
    EXPECT_GT(carried.information(2, 2), 0.0);
}

TEST(MotionPrior, WithoutImagesTheWheelsStepInAndWithoutThoseTheVelocity) {
    MotionPredictor predictor(config_of(PriorKind::kVisual));
    Frame frame = frame_at(0.1, Pose2d());
    add_images(frame, 0.0, 0.1);
    predictor.predict(frame);
    predictor.update(frame, {});
    frame = frame_at(0.2, kStep);
    add_images(frame, 0.1, 0.2);
    frame.visual[2].status = VisualStatus::kTooDark;
    const MotionPrior wheels = predictor.predict(frame);
    EXPECT_EQ(wheels.used, PriorKind::kWheel);
    EXPECT_THAT(wheels.before_from_now, PoseNear(kStep, 1e-12, 1e-12));
    predictor.update(frame, kStep);
    frame = frame_at(0.7);
    const MotionPrior velocity = predictor.predict(frame);
    EXPECT_EQ(velocity.used, PriorKind::kConstantVelocity) << "the images are half a second old";
    predictor.update(frame, kStep);
    frame = frame_at(0.8, kStep);
    add_images(frame, 0.6, 0.8);
    EXPECT_EQ(predictor.predict(frame).used, PriorKind::kVisual) << "and back again";
}

TEST(MotionPrior, ImagesAreCarriedOnAsFarAsTheConfigSays) {
    for (const double allowed : {0.05, 0.3}) {
        MotionPriorConfig config = config_of(PriorKind::kVisual);
        config.visual_extrapolation = allowed;
        MotionPredictor predictor(config);
        Frame frame = frame_at(0.1);
        add_images(frame, 0.0, 0.2);
        predictor.predict(frame);
        predictor.update(frame, {});
        EXPECT_EQ(predictor.predict(frame_at(0.35)).used == PriorKind::kVisual, allowed > 0.15);
    }
}

TEST(MotionPrior, OtherKindsDoNotLookAtImages) {
    for (const PriorKind kind :
         {PriorKind::kNone, PriorKind::kConstantVelocity, PriorKind::kWheel}) {
        MotionPredictor predictor(config_of(kind));
        Frame frame = frame_at(0.1);
        add_images(frame, 0.0, 0.2);
        predictor.predict(frame);
        predictor.update(frame, {});
        EXPECT_NE(predictor.predict(frame_at(0.2)).used, PriorKind::kVisual);
    }
}

TEST(MotionPrior, TheLagIsCountedFromTheNewestImage) {
    MotionPredictor predictor(config_of(PriorKind::kVisual));
    Frame frame = frame_at(0.05);
    predictor.predict(frame);
    EXPECT_FALSE(predictor.visual_lag(frame).has_value()) << "before the first image";
    predictor.update(frame, {});
    frame = frame_at(0.13);
    add_images(frame, 0.0, 0.1);
    predictor.predict(frame);
    EXPECT_NEAR(predictor.visual_lag(frame).value(), 0.03, 1e-9);
    predictor.update(frame, {});
    frame = frame_at(0.19);
    add_images(frame, 0.1, 0.2);
    predictor.predict(frame);
    EXPECT_NEAR(predictor.visual_lag(frame).value(), -0.01, 1e-9);
    for (double stamp = 0.3; stamp < 3.0; stamp += 0.1) {  // the camera falls silent
        frame = frame_at(stamp);
        predictor.predict(frame);
        ASSERT_TRUE(predictor.visual_lag(frame).has_value()) << stamp;
        ASSERT_NEAR(*predictor.visual_lag(frame), stamp - 0.2, 1e-9);
        predictor.update(frame, {});
    }
}

TEST(MotionPrior, TheVelocityIsAnAlternativeToImages) {
    MotionPredictor predictor(config_of(PriorKind::kVisual));
    predictor.update(frame_at(0.0), {});
    Frame frame = frame_at(0.1);
    add_images(frame, 0.0, 0.1);
    predictor.predict(frame);
    predictor.update(frame, kStep);
    frame = frame_at(0.2);
    add_images(frame, 0.1, 0.2);
    const MotionPrior prior = predictor.predict(frame);
    const auto starts = predictor.alternatives(frame, prior);
    ASSERT_EQ(starts.size(), 3U);
    EXPECT_EQ(starts[0].used, PriorKind::kVisual);
    EXPECT_EQ(starts[1].used, PriorKind::kConstantVelocity);
    EXPECT_EQ(starts[2].used, PriorKind::kNone);
    for (const MotionPrior& start : starts) {
        EXPECT_TRUE(start.information.isZero(0.0));
    }
}

TEST(MotionPrior, NamesItsKinds) {
    EXPECT_EQ(to_string(PriorKind::kVisual), "visual");
    EXPECT_EQ(to_string(PriorKind::kNone), "none");
    EXPECT_EQ(to_string(PriorKind::kConstantVelocity), "constant_velocity");
    EXPECT_EQ(to_string(PriorKind::kWheel), "wheel");
}

}  // namespace
}  // namespace hybrid_slam::test
