// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/calibration/extrinsics.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"
#include "synthetic_drive.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

using Errors = Eigen::Matrix<double, kExtrinsics, 1>;

constexpr double kSeconds = 90.0;

/// What a robot's file says before: wrong by what a tape measure leaves, y of the lidar right.
Pose2d assumed_laser(const SyntheticSensors& sensors) {
    return {1.26, sensors.robot_from_laser.y(), 0.0};
}
const Pose2d kAssumedCamera{1.16, -0.08, radians(-0.5)};

ExtrinsicsDrive drive_of(const SyntheticSensors& sensors, double seconds = kSeconds) {
    return drive_of(Way(figure_of_eight(seconds), seconds), seconds, sensors,
                    assumed_laser(sensors), kAssumedCamera);
}

SyntheticSensors noisy(unsigned seed, double factor = 1.0) {
    SyntheticSensors sensors;
    sensors.camera_time = 0.025;
    sensors.visual_scale = 1.01;
    sensors.lidar_translation = factor * 0.002;
    sensors.lidar_heading = factor * radians(0.03);
    sensors.vision_translation = factor * 0.0005;
    sensors.vision_heading = factor * radians(0.01);
    sensors.seed = seed;
    return sensors;
}

Errors errors_of(const ExtrinsicsResult& result, const SyntheticSensors& truth) {
    const Pose2d& laser = truth.robot_from_laser;
    const Pose2d& camera = truth.robot_from_camera;
    Errors errors;
    errors << result.camera_time - truth.camera_time, result.visual_scale - truth.visual_scale,
        normalize_angle(result.robot_from_laser.heading - laser.heading),
        result.robot_from_laser.x() - laser.x(),
        normalize_angle(result.robot_from_camera.heading - camera.heading),
        result.robot_from_camera.x() - camera.x(), result.robot_from_camera.y() - camera.y();
    return errors;
}

/// The targets of a real calibration: 2 ms, 0.1 deg, 1 cm.
void expect_good(const ExtrinsicsResult& result, const SyntheticSensors& truth) {
    EXPECT_THAT(result.missing, IsEmpty());
    EXPECT_NEAR(result.camera_time, truth.camera_time, 0.002);
    EXPECT_NEAR(result.visual_scale, truth.visual_scale, 0.005);
    EXPECT_THAT(result.robot_from_laser, PoseNear(truth.robot_from_laser, 0.01, radians(0.1)));
    EXPECT_THAT(result.robot_from_camera, PoseNear(truth.robot_from_camera, 0.01, radians(0.1)));
}

TEST(Extrinsics, ExactMotionsGiveExactMountings) {
    for (const double time : {0.0, 0.025, -0.2}) {
        SyntheticSensors sensors;
        sensors.camera_time = time;
        sensors.visual_scale = 0.97;
        sensors.scan_rate = 50.0;  // an interpolated curve is a little short
        sensors.image_rate = 250.0;
        const ExtrinsicsResult result = calibrate_extrinsics(drive_of(sensors, 70.0));
        EXPECT_TRUE(result.converged);
        EXPECT_THAT(result.missing, IsEmpty());
        EXPECT_LT(errors_of(result, sensors).cwiseAbs().maxCoeff(), 5e-6) << time;
        EXPECT_EQ(result.outliers, 0U);
    }
}

TEST(Extrinsics, MountingsMayBeFarFromTheAssumedOnes) {
    SyntheticSensors sensors;
    sensors.camera_time = 0.3;
    sensors.robot_from_laser = {-0.5, 0.1, radians(140.0)};
    sensors.robot_from_camera = {0.4, 0.6, radians(-170.0)};
    const Way way(figure_of_eight(kSeconds), kSeconds);
    const ExtrinsicsDrive drive =
        drive_of(way, kSeconds, sensors, {0.0, 0.1, radians(185.0)}, {0.0, 0.0, radians(-130.0)});
    expect_good(calibrate_extrinsics(drive), sensors);
}

TEST(Extrinsics, SigmasAreHonest) {
    constexpr int kSeeds = 20;
    Errors squares = Errors::Zero();
    for (unsigned seed = 1; seed <= kSeeds; ++seed) {
        const SyntheticSensors sensors = noisy(seed);
        const ExtrinsicsResult result = calibrate_extrinsics(drive_of(sensors));
        EXPECT_THAT(result.missing, IsEmpty());
        const Errors sigmas = Eigen::Map<const Errors>(result.sigmas.data());
        squares += errors_of(result, sensors).cwiseQuotient(sigmas).cwiseAbs2() / kSeeds;
    }
    // A mean of 20 squares of a unit Gaussian is below 1.6 in 95 of 100 cases. They may come out
    // too small: noise of single poses nearly cancels over many intervals.
    EXPECT_LT(squares.maxCoeff(), 1.6) << squares.transpose();
    EXPECT_LT(squares.mean(), 1.1) << squares.transpose();
    EXPECT_GT(squares.mean(), 0.15) << squares.transpose();
}

TEST(Extrinsics, TwiceTheNoiseTwiceTheSigmas) {
    const ExtrinsicsResult once = calibrate_extrinsics(drive_of(noisy(3, 1.0)));
    const ExtrinsicsResult twice = calibrate_extrinsics(drive_of(noisy(3, 2.0)));
    for (std::size_t i = 0; i < kExtrinsics; ++i) {
        EXPECT_NEAR(twice.sigmas[i] / once.sigmas[i], 2.0, 0.2) << i;
    }
    EXPECT_NEAR(twice.rms_heading / once.rms_heading, 2.0, 0.2);
    EXPECT_NEAR(twice.rms_slip / once.rms_slip, 2.0, 0.2);
}

TEST(Extrinsics, LidarYStaysAndCameraYFollowsIt) {
    const SyntheticSensors sensors;
    const Way way(figure_of_eight(kSeconds), kSeconds);
    const Pose2d wrong(1.3, sensors.robot_from_laser.y() + 0.2, 0.0);
    const ExtrinsicsResult result =
        calibrate_extrinsics(drive_of(way, kSeconds, sensors, wrong, kAssumedCamera));
    EXPECT_EQ(result.robot_from_laser.y(), wrong.y());
    EXPECT_NEAR(result.robot_from_camera.y(), sensors.robot_from_camera.y() + 0.2, 1e-3);
    EXPECT_NEAR(result.robot_from_laser.x(), sensors.robot_from_laser.x(), 1e-3);
}

TEST(Extrinsics, TellsOfTheDrive) {
    const ExtrinsicsDrive drive = drive_of(noisy(1));
    const ExtrinsicsResult result = calibrate_extrinsics(drive);
    EXPECT_NEAR(result.distance, 0.3 * kSeconds, 1.0);
    EXPECT_NEAR(result.turned_left - result.turned_right,
                drive.lidar.back().pose.heading - drive.lidar.front().pose.heading, 0.3);
    EXPECT_GT(std::min(result.turned_left, result.turned_right), radians(300.0));
    EXPECT_NEAR(static_cast<double>(result.intervals), kSeconds / 1.5, 4.0);
    EXPECT_LE(result.blind, 2U);  // vision begins after the first scan and ends before the last
}

TEST(Extrinsics, WrongMotionsAreOutliers) {
    const SyntheticSensors sensors = noisy(5);
    ExtrinsicsDrive drive = drive_of(sensors);
    for (std::size_t i = 0; i < drive.vision.size(); ++i) {
        if (i % 500 < 40) {  // 1.3 s of every 17 s: somebody walks past
            drive.vision[i].before_from_now = {0.02, 0.01, radians(0.5)};
        }
    }
    const ExtrinsicsResult result = calibrate_extrinsics(drive);
    expect_good(result, sensors);
    EXPECT_GE(result.outliers, 5U);
    EXPECT_LE(result.outliers, 12U);
}

TEST(Extrinsics, GapsOfVisionAreLeftOut) {
    const SyntheticSensors sensors = noisy(6);
    ExtrinsicsDrive drive = drive_of(sensors);
    for (std::size_t i = 600; i < 750; ++i) {  // dark for 5 s
        drive.vision[i].status = VisualStatus::kTooDark;
        drive.vision[i].before_from_now = {};
    }
    drive.vision.erase(drive.vision.begin() + 1500, drive.vision.begin() + 1600);  // none at all
    const ExtrinsicsResult result = calibrate_extrinsics(drive);
    expect_good(result, sensors);
    EXPECT_GE(result.blind, 5U);
    EXPECT_LE(result.blind, 10U);
    EXPECT_EQ(result.outliers, 0U);
}

TEST(Extrinsics, GapsOfScansAreLeftOut) {
    const SyntheticSensors sensors = noisy(7);
    ExtrinsicsDrive drive = drive_of(sensors);
    // After 4 s without scans the local frame has jumped.
    drive.lidar.erase(drive.lidar.begin() + 400, drive.lidar.begin() + 450);
    for (std::size_t i = 400; i < drive.lidar.size(); ++i) {
        drive.lidar[i].pose = Pose2d(3.0, 1.0, 2.0) * drive.lidar[i].pose;
    }
    const ExtrinsicsResult result = calibrate_extrinsics(drive);
    expect_good(result, sensors);
    EXPECT_EQ(result.outliers, 0U);
}

TEST(Extrinsics, StandingTellsNothing) {
    const auto stop_and_go = [](double time) -> Eigen::Vector2d {
        const Eigen::Vector2d driving = figure_of_eight(120.0)(time);
        return time > 40.0 && time < 70.0 ? Eigen::Vector2d::Zero() : driving;
    };
    const SyntheticSensors sensors = noisy(8);
    const ExtrinsicsResult result = calibrate_extrinsics(
        drive_of(Way(stop_and_go, 120.0), 120.0, sensors, assumed_laser(sensors), kAssumedCamera));
    expect_good(result, sensors);
    EXPECT_NEAR(static_cast<double>(result.standing), 19.0, 1.0);
}

ExtrinsicsResult of_driving(const Driving& driving, double seconds = kSeconds) {
    const SyntheticSensors sensors = noisy(9);
    return calibrate_extrinsics(
        drive_of(Way(driving, seconds), seconds, sensors, assumed_laser(sensors), kAssumedCamera));
}

TEST(Extrinsics, StraightDriveIsRefused) {
    const ExtrinsicsResult result =
        of_driving([](double time) { return Eigen::Vector2d(0.3, 0.01 * std::sin(time)); });
    EXPECT_FALSE(result.fit());
    EXPECT_THAT(result.missing, Contains(HasSubstr("deg turned, 180 deg are needed")));
    EXPECT_THAT(result.missing, Contains(HasSubstr("the turn rate hardly changes")));
    EXPECT_THAT(result.missing, Not(Contains(HasSubstr("m driven"))));
}

TEST(Extrinsics, SteadyCircleIsRefused) {
    const ExtrinsicsResult result = of_driving([](double) { return Eigen::Vector2d(0.3, 0.3); });
    EXPECT_THAT(result.missing, Contains(HasSubstr("the turn rate hardly changes")));
}

TEST(Extrinsics, SteadyCircleHidesTimeAndSlip) {
    SyntheticSensors exact;
    ExtrinsicsConfig config;
    config.least_rate_spread = 0.0;
    const Way circle([](double) { return Eigen::Vector2d(0.3, 0.3); }, kSeconds);
    const ExtrinsicsResult result = calibrate_extrinsics(
        drive_of(circle, kSeconds, exact, assumed_laser(exact), kAssumedCamera), config);
    // Of the prior's second, radians and metres hardly anything is gone.
    EXPECT_GT(result.sigma(Extrinsic::kTime), 0.3);
    EXPECT_GT(result.sigma(Extrinsic::kLaserYaw), 0.3);
    EXPECT_THAT(result.missing, Contains(HasSubstr("camera time is known to +-")));
    EXPECT_THAT(result.missing, Contains(HasSubstr("lidar yaw is known to +-")));
}

TEST(Extrinsics, TurningOneWayAtChangingRatesWillDo) {
    const ExtrinsicsResult result = of_driving(
        [](double time) { return Eigen::Vector2d(0.3, 0.2 + 0.2 * std::sin(0.5 * time)); });
    EXPECT_THAT(result.missing, IsEmpty());
    EXPECT_LT(result.turned_right, radians(1.0));
    EXPECT_GT(result.turned_left, radians(900.0));
}

TEST(Extrinsics, ShortDriveIsRefused) {
    const ExtrinsicsResult result = of_driving(figure_of_eight(9.0), 9.0);
    EXPECT_THAT(result.missing, Contains(HasSubstr("m driven, 4.0 m are needed")));
    EXPECT_THAT(result.missing, Contains(HasSubstr("intervals of 1.5 s")));
}

TEST(Extrinsics, BadSensorsAreRefusedByTheirSigmas) {
    const ExtrinsicsResult result = calibrate_extrinsics(drive_of(noisy(4, 25.0), 70.0));
    EXPECT_THAT(result.missing, Contains(HasSubstr("camera x is known to +-")));
}

TEST(Extrinsics, NothingIsRefusedQuietly) {
    const ExtrinsicsResult result = calibrate_extrinsics({});
    EXPECT_FALSE(result.fit());
    EXPECT_EQ(result.intervals, 0U);
    ExtrinsicsDrive blind = drive_of(noisy(1));
    blind.vision.clear();
    EXPECT_THAT(calibrate_extrinsics(blind).missing, Contains(HasSubstr("only 0 intervals")));
}

TEST(Extrinsics, SameInputSameBits) {
    const ExtrinsicsDrive drive = drive_of(noisy(2));
    const ExtrinsicsResult a = calibrate_extrinsics(drive);
    const ExtrinsicsResult b = calibrate_extrinsics(drive);
    EXPECT_EQ(a.robot_from_camera.vector(), b.robot_from_camera.vector());
    EXPECT_EQ(a.sigmas, b.sigmas);
}

TEST(Extrinsics, SaysHowMuchTooLongWaysAreSeen) {
    ExtrinsicsResult result;
    result.visual_scale = 0.805;
    double& sigma = result.sigmas[static_cast<std::size_t>(Extrinsic::kScale)];
    sigma = 0.01;
    ASSERT_TRUE(result.ways_too_long());
    EXPECT_NEAR(*result.ways_too_long(), 0.242, 0.001);
    result.visual_scale = 1.25;
    EXPECT_NEAR(*result.ways_too_long(), -0.2, 1e-12);
    for (const double useless : {0.06, std::nan("")}) {
        sigma = useless;
        EXPECT_FALSE(result.ways_too_long());
    }
    sigma = 0.01;
    for (const double useless : {0.0, -0.8, std::nan("")}) {
        result.visual_scale = useless;
        EXPECT_FALSE(result.ways_too_long());
    }
    result.visual_scale = 0.805;
    result.missing.emplace_back("no images");
    EXPECT_FALSE(result.ways_too_long()) << "of a drive that is refused";
}

TEST(Extrinsics, ConfigOutOfRangeIsAnError) {
    ExtrinsicsConfig config;
    config.interval = 0.0;
    EXPECT_THAT(error_of([&] { calibrate_extrinsics({}, config); }), HasSubstr("interval"));
}

}  // namespace
}  // namespace hybrid_slam::test
