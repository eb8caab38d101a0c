// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/odometry/odometry.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <set>

#include "hybrid_slam/core/uncertainty.hpp"
#include "odometry_drive.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

/// The thesis's: the previous scan, points to points, no prior.
OdometryConfig plain_icp() {
    OdometryConfig config = config_of(PriorKind::kNone);
    config.reference = ReferenceKind::kPreviousScan;
    config.icp.metric = IcpMetric::kPointToPoint;
    return config;
}

class OdometryByPrior : public ::testing::TestWithParam<PriorKind> {};

TEST_P(OdometryByPrior, FollowsALapThroughARoom) {
    const Drive drive;
    const Outcome found = follow(config_of(GetParam()), drive.frames, drive.truth);
    EXPECT_LT(found.worst, 0.01) << "10 mm, 0.6 degrees after 11 m and a full turn";
    EXPECT_EQ(found.results[0].status, OdometryStatus::kFirst);
    for (std::size_t i = 1; i < found.results.size(); ++i) {
        ASSERT_EQ(found.results[i].status, OdometryStatus::kAligned);
        ASSERT_THAT(found.results[i - 1].local_from_robot * found.results[i].before_from_now,
                    PoseNear(found.results[i].local_from_robot, 1e-12, 1e-12));
    }
    // The last lap's prior is what was asked for in all frames but the first, which has none before
    // it.
    EXPECT_GE(found.priors.at(GetParam()), 158);
}

INSTANTIATE_TEST_SUITE_P(Priors, OdometryByPrior,
                         ::testing::Values(PriorKind::kNone, PriorKind::kConstantVelocity,
                                           PriorKind::kWheel),
                         [](const auto& test) { return std::string(to_string(test.param)); });

TEST(Odometry, StartsAtZeroWithAKeyframe) {
    const Drive drive;
    Odometry odometry(config_of(PriorKind::kWheel));
    const OdometryResult first = odometry.register_frame(drive.frames[0]);
    EXPECT_EQ(first.status, OdometryStatus::kFirst);
    EXPECT_THAT(first.local_from_robot, PoseNear(Pose2d(), 0.0, 0.0));
    EXPECT_TRUE(first.keyframe);
    EXPECT_GT(first.surface.size(), 100U);
    EXPECT_TRUE(first.covariance.isZero(0.0));
}

TEST(Odometry, KeepsFramesBySpacingOfPlaceAndHeading) {
    const Drive drive;
    const Outcome found = follow(config_of(PriorKind::kWheel), drive.frames, drive.truth);
    Pose2d last;
    for (std::size_t i = 1; i < found.results.size(); ++i) {
        const Pose2d moved = between(last, found.results[i].local_from_robot);
        const bool far =
            moved.translation.norm() >= 0.4 || std::abs(moved.heading) >= radians(20.0);
        ASSERT_EQ(found.results[i].keyframe, far) << i;
        last = far ? found.results[i].local_from_robot : last;
    }
    EXPECT_GT(found.kept, 20);
}

// Scan to scan and point to point the same beams pair with each other and hold the robot back:
// steps must not be much smaller than the spacing of the points. It drifts, but does not get lost.
TEST(Odometry, ThePlainIcpOfTheThesisWorksOnSmallSteps) {
    const Trajectory truth = ellipse_lap(60);
    Lidar lidar = noisy_lidar();
    lidar.beams = 1081;
    OdometryConfig config = plain_icp();
    config.icp.kernel = IcpKernel::kNone;
    config.icp.max_iterations = 30;
    const auto frames = frames_along(irregular_room(), truth, lidar, 42);
    const Outcome found = follow(config, frames, truth);
    EXPECT_EQ(found.priors.at(PriorKind::kNone), 60);
    EXPECT_LT(found.worst, 0.8);
    for (std::size_t i = 1; i < frames.size(); ++i) {
        ASSERT_EQ(found.results[i].status, OdometryStatus::kAligned);
        ASSERT_THAT(found.results[i].before_from_now,
                    PoseNear(between(truth[i - 1].pose, truth[i].pose), 0.05, radians(2.0)));
    }
}

TEST(Odometry, TheLocalMapDriftsLessThanThePreviousScan) {
    const Drive drive;
    OdometryConfig config = config_of(PriorKind::kWheel);
    const double by_map = follow(config, drive.frames, drive.truth).worst;
    config.reference = ReferenceKind::kPreviousScan;
    const double by_scan = follow(config, drive.frames, drive.truth).worst;
    EXPECT_LT(by_map, by_scan);
    EXPECT_LT(by_scan, 0.2);
}

TEST(Odometry, OvercomesWheelsThatNeverGoBackwards) {
    const Trajectory truth = there_and_back();
    const auto frames = with_wheels(truth, [](std::size_t, const Pose2d& step) {
        return Pose2d(std::abs(step.x()), step.y(), step.heading);
    });
    EXPECT_LT(follow(config_of(PriorKind::kWheel), frames, truth).worst, 0.02);
}

TEST(Odometry, OvercomesWheelsThatLag) {
    // Nothing for four frames, then all of it at once.
    const Trajectory truth = there_and_back();
    std::vector<Frame> frames = frames_along(irregular_room(), truth, noisy_lidar(), 44);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        frames[i].odom_from_robot = between(truth[0].pose, truth[i - i % 5].pose);
    }
    EXPECT_LT(follow(config_of(PriorKind::kWheel), frames, truth).worst, 0.02);
}

TEST(Odometry, OvercomesWheelsThatSlipOnce) {
    const Trajectory truth = there_and_back();
    const auto frames = with_wheels(truth, [](std::size_t i, const Pose2d& step) {
        return i == 30 ? step * Pose2d(1.0, 0.0, 0.3) : step;
    });
    const Outcome found = follow(config_of(PriorKind::kWheel), frames, truth);
    EXPECT_LT(found.worst, 0.02);
}

TEST(Odometry, SaysWhenTheWheelsWereMissing) {
    Drive drive;
    for (std::size_t i = 50; i < 60; ++i) {
        drive.frames[i].odom_from_robot.reset();
    }
    const Outcome found = follow(config_of(PriorKind::kWheel), drive.frames, drive.truth);
    EXPECT_EQ(found.priors.at(PriorKind::kConstantVelocity), 11) << "ten, and the one after them";
    EXPECT_EQ(found.priors.at(PriorKind::kWheel), 148);
    EXPECT_LT(found.worst, 0.01);
}

double uncertainty(const OdometryResult& result) {
    return result.covariance.trace();
}

TEST(Odometry, BlindFramesAreCarriedByThePriorWithGrowingUncertainty) {
    Drive drive;
    for (std::size_t i = 40; i < 50; ++i) {
        const double stamp = drive.frames[i].scan.stamp;
        drive.frames[i].scan = blind_scan();
        drive.frames[i].scan.stamp = stamp;
    }
    const Outcome found = follow(config_of(PriorKind::kWheel), drive.frames, drive.truth);
    for (std::size_t i = 40; i < 50; ++i) {
        EXPECT_EQ(found.results[i].status, OdometryStatus::kPriorOnly);
        EXPECT_EQ(found.results[i].surface.size(), 0U);
        EXPECT_GT(uncertainty(found.results[i]), uncertainty(found.results[i - 1]));
        EXPECT_FALSE(found.results[i].icp.usable());
    }
    EXPECT_EQ(found.results[50].status, OdometryStatus::kAligned);
    EXPECT_LT(uncertainty(found.results[50]), 0.1 * uncertainty(found.results[49]));
    EXPECT_LT(found.worst, 0.01) << "the wheels were true, and the map was still there";
}

TEST(Odometry, BlindFramesWithoutAPriorAreAStandstillOfUnknownExtent) {
    Drive drive;
    drive.frames.resize(45);
    for (std::size_t i = 40; i < 45; ++i) {
        drive.frames[i].scan.ranges.assign(drive.frames[i].scan.ranges.size(), 0.0F);
    }
    const Outcome found = follow(config_of(PriorKind::kNone), drive.frames, drive.truth);
    for (std::size_t i = 40; i < 45; ++i) {
        EXPECT_EQ(found.results[i].status, OdometryStatus::kPriorOnly);
        EXPECT_THAT(found.results[i].before_from_now, PoseNear(Pose2d(), 0.0, 0.0));
        EXPECT_GT(uncertainty(found.results[i]), uncertainty(found.results[i - 1]) + 0.1);
        EXPECT_TRUE(found.results[i].covariance.allFinite());
    }
}

/// A drive with images of which those before frame `until` tell ways that are `factor` as long.
std::vector<Frame> with_a_stretched_camera(const Drive& drive, double factor, std::size_t until) {
    std::vector<Frame> frames = with_images(drive.frames, drive.truth, 0.001);
    for (std::size_t i = 0; i < until; ++i) {
        for (VisualMotion& motion : frames[i].visual) {
            motion.before_from_now.translation *= factor;
        }
    }
    return frames;
}

/// Variance of where the prior alone puts the robot against the frame before: x and y together.
double variance_of_step(const Outcome& found, std::size_t blind) {
    const OdometryResult& before = found.results[blind - 1];
    const OdometryResult& now = found.results[blind];
    const Eigen::Matrix3d carried = swung(
        before.covariance, now.local_from_robot.translation - before.local_from_robot.translation);
    return (now.covariance - carried).topLeftCorner<2, 2>().trace();
}

TEST(Odometry, VisionThatContradictsTheScansIsDoubtedAndBelievedLess) {
    constexpr std::size_t kBlind = 60;
    Drive drive;
    const double stamp = drive.frames[kBlind].scan.stamp;
    drive.frames[kBlind].scan = blind_scan();
    drive.frames[kBlind].scan.stamp = stamp;
    const OdometryConfig config = config_of(PriorKind::kVisual);
    const Outcome agreeing =
        follow(config, with_a_stretched_camera(drive, 1.0, kBlind), drive.truth);
    const Outcome contradicting =
        follow(config, with_a_stretched_camera(drive, 1.5, kBlind), drive.truth);
    for (std::size_t i = 0; i < agreeing.results.size(); ++i) {
        ASSERT_LT(agreeing.results[i].visual_doubt, 1.5) << i;
    }
    ASSERT_LE(agreeing.results[kBlind - 1].visual_doubt, 1.0) << "else it counted below";
    const double doubt = contradicting.results[kBlind - 1].visual_doubt;
    EXPECT_GT(doubt, 5.0);
    EXPECT_LT(contradicting.worst, 0.01) << "the scans are still right";
    ASSERT_EQ(contradicting.results[kBlind].status, OdometryStatus::kPriorOnly);
    ASSERT_EQ(contradicting.results[kBlind].prior_used, PriorKind::kVisual);
    EXPECT_FALSE(contradicting.results[kBlind].keyframe ||
                 contradicting.results[kBlind - 1].keyframe);
    // In the blind frame both cameras tell the same, so that doubt alone makes the difference.
    EXPECT_NEAR(variance_of_step(contradicting, kBlind) / variance_of_step(agreeing, kBlind), doubt,
                1e-6 * doubt);
    EXPECT_LT(contradicting.results.back().visual_doubt, 0.1 * doubt) << "it is right again";
}

class OdometryThatStartsBlind : public ::testing::TestWithParam<PriorKind> {};

TEST_P(OdometryThatStartsBlind, BeginsItsMapWithTheFirstPoints) {
    Drive drive;
    for (std::size_t i = 0; i < 3; ++i) {
        drive.frames[i].scan.ranges.assign(drive.frames[i].scan.ranges.size(), 0.0F);
    }
    const Outcome found = follow(config_of(GetParam()), drive.frames, drive.truth);
    EXPECT_EQ(found.results[0].status, OdometryStatus::kFirst);
    EXPECT_EQ(found.results[2].status, OdometryStatus::kPriorOnly);
    for (std::size_t i = 4; i < found.results.size(); ++i) {
        ASSERT_EQ(found.results[i].status, OdometryStatus::kAligned) << "frame " << i;
    }
    // What the first frames missed stays missed; after them nothing is lost.
    const Pose2d local_from_start = found.results[3].local_from_robot;
    EXPECT_LT(apart(between(drive.truth[3].pose, drive.truth.back().pose),
                    between(local_from_start, found.results.back().local_from_robot)),
              0.01);
}

INSTANTIATE_TEST_SUITE_P(Priors, OdometryThatStartsBlind,
                         ::testing::Values(PriorKind::kNone, PriorKind::kConstantVelocity,
                                           PriorKind::kWheel),
                         [](const auto& test) { return std::string(to_string(test.param)); });

TEST(Odometry, StampsThatRunBackwardsDoNoHarm) {
    Drive drive;
    for (std::size_t i = 60; i < drive.frames.size(); ++i) {
        drive.frames[i].scan.stamp -= 3.0;
    }
    drive.frames[100].scan.stamp = drive.frames[99].scan.stamp;
    for (const PriorKind prior : {PriorKind::kConstantVelocity, PriorKind::kWheel}) {
        const Outcome found = follow(config_of(prior), drive.frames, drive.truth);
        EXPECT_LT(found.worst, 0.01);
    }
}

TEST(Odometry, DeskewsWithTheMotionItPredicts) {
    // 1.6 m/s and 0.9 rad/s with sweeps that last the whole 0.1 s between scans.
    const World world = irregular_room();
    const Eigen::Vector3d twist(1.3, 0.0, 0.9);
    Lidar lidar = noisy_lidar();
    lidar.time_increment = 0.1 / lidar.beams;
    Rng rng(45);
    Trajectory truth;
    std::vector<Frame> frames;
    Pose2d pose(0.6, -1.9, 0.0);
    for (int i = 0; i < 70; ++i) {
        truth.push_back({0.1 * i, pose});
        Frame frame;
        frame.scan = scan_at(world, pose, lidar, rng, twist);
        frame.scan.stamp = 0.1 * i;
        frame.odom_from_robot = between(truth[0].pose, pose);
        frames.push_back(frame);
        pose = pose * Pose2d::exp(0.1 * twist);
    }
    const double deskewed = follow(config_of(PriorKind::kWheel), frames, truth).worst;
    EXPECT_LT(deskewed, 0.12) << "the first sweep, before any motion is known, stays skewed";
    for (Frame& frame : frames) {
        frame.scan.time_increment = 0.0;
    }
    EXPECT_LT(deskewed, follow(config_of(PriorKind::kWheel), frames, truth).worst);
}

TEST(Odometry, ClaimsACovarianceThatItsErrorsMatch) {
    // Against the first scan alone, so that errors do not pass through a map.
    const World world = irregular_room();
    const Lidar lidar = noisy_lidar();
    Rng rng(46);
    double normalized = 0.0;
    constexpr int kRuns = 60;
    for (int i = 0; i < kRuns; ++i) {
        Odometry odometry(config_of(PriorKind::kNone));
        const Pose2d step(uniform(rng, -0.1, 0.1), uniform(rng, -0.1, 0.1),
                          uniform(rng, -0.1, 0.1));
        Frame frame;
        frame.scan = scan_at(world, {}, lidar, rng);
        odometry.register_frame(frame);
        frame.scan = scan_at(world, step, lidar, rng);
        frame.scan.stamp = 0.1;
        const OdometryResult result = odometry.register_frame(frame);
        const Eigen::Vector3d error = result.local_from_robot.vector() - step.vector();
        normalized += error.dot(result.covariance.inverse() * error) / 3.0 / kRuns;
    }
    EXPECT_LT(normalized, 4.0) << "claims too much";
    EXPECT_GT(normalized, 0.05) << "claims too little";
}

TEST(Odometry, IsTheSameToTheBitWhenRepeated) {
    const Drive drive;
    const Outcome first = follow(config_of(PriorKind::kWheel), drive.frames, drive.truth);
    const Outcome second = follow(config_of(PriorKind::kWheel), drive.frames, drive.truth);
    for (std::size_t i = 0; i < first.results.size(); ++i) {
        ASSERT_EQ(first.results[i].local_from_robot.vector(),
                  second.results[i].local_from_robot.vector());
        ASSERT_EQ(first.results[i].covariance, second.results[i].covariance);
    }
}

// ---- visual odometry ----

TEST(Odometry, FollowsALapWithImages) {
    const Drive drive;
    const auto frames = with_images(drive.frames, drive.truth, 1e-3);
    const Outcome found = follow(config_of(PriorKind::kVisual), frames, drive.truth);
    EXPECT_LT(found.worst, 0.01);
    EXPECT_GE(found.priors.at(PriorKind::kVisual), 158);
    EXPECT_FALSE(found.results[0].visual_lag.has_value());
    for (std::size_t i = 1; i < found.results.size(); ++i) {
        ASSERT_EQ(found.results[i].status, OdometryStatus::kAligned);
        ASSERT_NEAR(found.results[i].visual_lag.value(), 0.0, 1e-9);
    }
}

TEST(Odometry, WithoutAReferenceItDeadReckons) {
    const Drive drive;
    OdometryConfig config = config_of(PriorKind::kVisual);
    config.reference = ReferenceKind::kNone;
    const Outcome exact = follow(config, with_images(drive.frames, drive.truth, 0.0), drive.truth);
    EXPECT_LT(exact.worst, 1e-6) << "the prior alone, whatever the scans say";
    const Outcome noisy = follow(config, with_images(drive.frames, drive.truth, 2e-3), drive.truth);
    EXPECT_GT(noisy.worst, 0.01);
    double before = 0.0;
    for (std::size_t i = 1; i < noisy.results.size(); ++i) {
        const OdometryResult& result = noisy.results[i];
        ASSERT_EQ(result.status, OdometryStatus::kDeadReckoned);
        ASSERT_EQ(result.prior_used, PriorKind::kVisual);
        ASSERT_FALSE(result.icp.usable());
        ASSERT_GT(uncertainty(result), before) << "it only grows";
        before = noisy.results[i].keyframe ? 0.0 : uncertainty(result);
    }
}

TEST(Odometry, DeadReckoningWithoutAPriorStandsStill) {
    const Drive drive;
    OdometryConfig config = config_of(PriorKind::kNone);
    config.reference = ReferenceKind::kNone;
    Odometry odometry(config);
    odometry.register_frame(drive.frames[0]);
    const OdometryResult result = odometry.register_frame(drive.frames[1]);
    EXPECT_EQ(result.status, OdometryStatus::kDeadReckoned);
    EXPECT_THAT(result.local_from_robot, PoseNear(Pose2d(), 0.0, 0.0));
    EXPECT_GT(uncertainty(result), 0.1);
}

/// Along an endless corridor, whose scans say nothing of the way along it.
Outcome along_a_corridor(double claimed_sigma) {
    Trajectory truth;
    std::vector<Frame> frames;
    Rng rng(48);
    for (int i = 0; i < 60; ++i) {
        truth.push_back({0.1 * i, Pose2d(0.05 * i, 0.0, 0.0)});
        Frame frame;
        frame.scan = scan_at(endless_corridor(), truth.back().pose, noisy_lidar(), rng);
        frame.scan.stamp = 0.1 * i;
        frames.push_back(frame);
    }
    frames = with_images(frames, truth, 0.0);
    for (Frame& frame : frames) {
        for (VisualMotion& motion : frame.visual) {
            motion.covariance = claimed_sigma * claimed_sigma * Eigen::Matrix3d::Identity();
        }
    }
    return follow(config_of(PriorKind::kVisual), frames, truth);
}

TEST(Odometry, ImagesCarryItAlongACorridorAndTheirDoubtShows) {
    const Outcome sure = along_a_corridor(5e-4);
    EXPECT_LT(sure.worst, 0.06) << "2 % of 3 m";
    const Outcome unsure = along_a_corridor(5e-3);
    for (std::size_t i = 1; i < sure.results.size(); ++i) {
        if (!sure.results[i].keyframe && !unsure.results[i].keyframe) {
            // Along the corridor the images alone know; across it the walls do.
            ASSERT_LT(sure.results[i].covariance(0, 0), unsure.results[i].covariance(0, 0)) << i;
            ASSERT_GT(unsure.results[i].covariance(0, 0), unsure.results[i].covariance(1, 1)) << i;
        }
    }
}

TEST(Odometry, OvercomesACameraThatLiesOnce) {
    const Drive drive;
    auto frames = with_images(drive.frames, drive.truth, 1e-4);
    frames[60].visual[2].before_from_now = Pose2d(0.7, 0.3, 0.3);
    EXPECT_LT(follow(config_of(PriorKind::kVisual), frames, drive.truth).worst, 0.02);
}

TEST(Odometry, EveryKeyOfItsConfigurationHasItsOwnField) {
    OdometryConfig config;
    ConfigSchema schema;
    describe(schema, config);
    std::set<std::string> keys;
    for (const ConfigField& field : schema.fields()) {
        EXPECT_TRUE(keys.insert(field.key).second) << field.key << " twice";
        EXPECT_FALSE(field.help.empty()) << field.key;
        field.set(field.get());
    }
    for (const char* key :
         {"odometry.prior", "odometry.reference", "prior.max_gap", "scan.range_max", "icp.metric",
          "local_map.scans", "keyframe.distance"}) {
        EXPECT_EQ(keys.count(key), 1U) << key;
    }
    schema.override_with("odometry.prior=constant_velocity");
    schema.override_with("icp.metric=point_to_point");
    EXPECT_EQ(config.prior.kind, PriorKind::kConstantVelocity);
    EXPECT_EQ(config.icp.metric, IcpMetric::kPointToPoint);
}

TEST(Odometry, NamesItsStatus) {
    EXPECT_EQ(to_string(OdometryStatus::kFirst), "first");
    EXPECT_EQ(to_string(OdometryStatus::kAligned), "aligned");
    EXPECT_EQ(to_string(OdometryStatus::kPriorOnly), "prior_only");
    EXPECT_EQ(to_string(OdometryStatus::kDeadReckoned), "dead_reckoned");
}

}  // namespace
}  // namespace hybrid_slam::test
