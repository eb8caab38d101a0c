// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "backend/localization/hall_drive.hpp"
#include "backend/localization/twin_halls.hpp"
#include "hybrid_slam/localization/localizer.hpp"
#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"

/// Wrong starts, kidnapping, blindness, and searches that end early.
namespace hybrid_slam::test {
namespace {

/// The second part follows in time on the first one; wheels do not notice that they were lifted.
TestDrive spliced(TestDrive drive, const TestDrive& then) {
    const double later = drive.truth.back().stamp + 1.0 / kScanRate - then.truth.front().stamp;
    const Pose2d shift =
        *drive.frames.back().odom_from_robot * then.frames.front().odom_from_robot->inverse();
    for (std::size_t i = 0; i < then.frames.size(); ++i) {
        drive.frames.push_back(then.frames[i]);
        drive.frames.back().scan.stamp += later;
        drive.frames.back().odom_from_robot = shift * *then.frames[i].odom_from_robot;
        drive.truth.push_back({then.truth[i].stamp + later, then.truth[i].pose});
    }
    return drive;
}

TEST(Localizer, AWrongStartIsNoticedAndMended) {
    const TestDrive drive = part_of(hall().drive, 100, 200);
    Localizer localizer(hall().map, {});
    const Pose2d told = drive.truth.front().pose * Pose2d(1.5, 1.2, 0.9);
    localizer.start_at(told, kGivenDoubt);
    const auto results = follow(localizer, drive.frames);
    std::size_t lost = 0;
    while (lost < results.size() && results[lost].status != LocalizationStatus::kLost) {
        ++lost;
    }
    ASSERT_LT(lost, static_cast<std::size_t>(kScanRate));
    EXPECT_TRUE(results[lost].map_from_robot.has_value());
    EXPECT_EQ(results[lost].score, 0.0);
    const std::size_t found = first_known(results, lost);
    ASSERT_LT(found, lost + 3);
    expect_right(results, drive.truth, found, results.size());
    ASSERT_TRUE(results[found].jump.has_value());
    EXPECT_THAT(results[found].jump->to, PoseNear(drive.truth[found].pose, 0.05, radians(1.0)));
    EXPECT_GT((results[found].jump->from.translation - results[found].jump->to.translation).norm(),
              0.5);
}

TEST(Localizer, AStartDuringTheDriveIsAJump) {
    const TestDrive drive = part_of(hall().drive, 100, 200);
    Localizer localizer(hall().map, {});
    std::optional<Jump> jump;
    for (std::size_t i = 0; i < 100; ++i) {
        if (i == 50) {
            localizer.start_at(drive.truth[i].pose * Pose2d(2.0, 0.0, 0.0), kGivenDoubt);
        }
        const LocalizationResult result = localizer.process(drive.frames[i]);
        if (i == 50) {
            jump = result.jump;
        }
    }
    ASSERT_TRUE(jump.has_value());
    EXPECT_THAT(jump->from, PoseNear(drive.truth[50].pose, 0.05, radians(1.0)));
}

TEST(Localizer, AJumpIsToldFromThePoseOfTheResultBefore) {
    const TestDrive drive = part_of(hall().drive, 100, 130);
    const LocalizationConfig config;
    const Eigen::Matrix3d doubt = Eigen::Vector3d(0.09, 0.09, 0.009).asDiagonal();
    // Wrong by so much that the scan which finds the right place has fitted a wrong one before.
    for (const Pose2d& wrong : {Pose2d(0.8, 0.8, 0.0), Pose2d(0.8, -0.8, 0.0)}) {
        Localizer localizer(hall().map, config);
        Odometry odometry(config.odometry);  // until it is lost, the localizer's does the same
        localizer.start_at(drive.truth.front().pose * wrong, doubt);
        std::optional<Pose2d> told;
        std::size_t jumps = 0;
        for (const Frame& frame : drive.frames) {
            const Pose2d motion = odometry.register_frame(frame).before_from_now;
            const LocalizationResult result = localizer.process(frame);
            ASSERT_TRUE(is_known(result));
            if (result.jump) {
                ++jumps;
                ASSERT_TRUE(told.has_value());
                EXPECT_THAT(result.jump->from, PoseNear(*told * motion, 1e-9, 1e-9));
                EXPECT_THAT(result.jump->to, PoseNear(*result.map_from_robot, 1e-9, 1e-9));
            }
            told = result.map_from_robot;
        }
        EXPECT_EQ(jumps, 1U);
        EXPECT_THAT(*told, PoseNear(drive.truth.back().pose, 0.05, radians(1.0)));
    }
}

TEST(Localizer, KidnappedItIsLostAndFoundAgain) {
    // Places of the lap by frames, each with another heading or far away.
    const std::size_t places[][2] = {{150, 400}, {300, 520}, {200, 330}, {500, 120}};
    for (const auto& [before, after] : places) {
        const TestDrive drive = spliced(part_of(hall().drive, before - 40, before),
                                        part_of(hall().drive, after, after + 80));
        Localizer localizer(hall().map, {});
        const auto results = follow(localizer, drive.frames);
        const std::size_t kidnapped = 40;
        std::size_t noticed = kidnapped;
        while (noticed < results.size() && results[noticed].status != LocalizationStatus::kLost) {
            ++noticed;
        }
        ASSERT_LE(noticed, kidnapped + static_cast<std::size_t>(kScanRate)) << before;
        const std::size_t found = first_known(results, noticed);
        ASSERT_LE(found, kidnapped + static_cast<std::size_t>(3.0 * kScanRate)) << before;
        expect_right(results, drive.truth, found, results.size());
        ASSERT_TRUE(results[found].jump.has_value());
        EXPECT_THAT(results[found].jump->to, PoseNear(drive.truth[found].pose, 0.05, radians(1.0)));
    }
}

TEST(Localizer, CarriedAwayOnlyALittleItSaysSo) {
    // So little that odometry, which aligns scans, follows; and into the look-alike opposite
    // corner.
    const std::size_t places[][2] = {{512, 618}, {124, 53}, {176, 523}};
    for (const auto& [before, after] : places) {
        const TestDrive drive = spliced(part_of(hall().drive, before - 25, before),
                                        part_of(hall().drive, after, after + 25));
        Localizer localizer(hall().map, {});
        const auto results = follow(localizer, drive.frames);
        EXPECT_TRUE(std::any_of(results.begin() + 25, results.begin() + 37, [](const auto& result) {
            return result.jump || result.status == LocalizationStatus::kLost;
        })) << before;
        expect_right(results, drive.truth, 38, results.size());
    }
}

TEST(Localizer, RefusesAStartThatIsNoBelief) {
    Localizer localizer(hall().map, {});
    const double nan = std::numeric_limits<double>::quiet_NaN();
    Eigen::Matrix3d negative = kGivenDoubt;
    negative(1, 1) = -1e-4;
    Eigen::Matrix3d unknown = kGivenDoubt;
    unknown(0, 2) = unknown(2, 0) = nan;
    Eigen::Matrix3d lopsided = kGivenDoubt;
    lopsided(0, 1) = 0.005;
    Eigen::Matrix3d indefinite = kGivenDoubt;  // correlated by more than 1
    indefinite(0, 1) = indefinite(1, 0) = 0.02;
    const Eigen::Matrix3d none = Eigen::Matrix3d::Zero();
    for (const Eigen::Matrix3d& bad : {negative, unknown, lopsided, indefinite, none}) {
        EXPECT_THAT(error_of([&] { localizer.start_at({}, bad); }),
                    ::testing::HasSubstr("covariance"))
            << bad;
    }
    EXPECT_NE(error_of([&] { localizer.start_at({nan, 0.0, 0.0}, kGivenDoubt); }), "");
    EXPECT_NE(error_of([&] { localizer.start_at({0.0, 0.0, nan}, kGivenDoubt); }), "");
    // And what was refused is not used.
    EXPECT_TRUE(localizer.process(hall().drive.frames[100]).relocalization.has_value());
}

TestDrive blinded(TestDrive drive, std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
        std::vector<float>& ranges = drive.frames[i].scan.ranges;
        std::fill(ranges.begin(), ranges.end(), std::numeric_limits<float>::infinity());
    }
    return drive;
}

TEST(Localizer, BlindItSearchesNothingAndSaysSo) {
    const TestDrive drive = blinded(part_of(hall().drive, 100, 150), 0, 20);
    Localizer localizer(hall().map, {});
    const auto results = follow(localizer, drive.frames);
    for (std::size_t i = 0; i < 20; ++i) {
        EXPECT_EQ(results[i].status, LocalizationStatus::kRelocalizing);
        EXPECT_FALSE(results[i].map_from_robot.has_value());
        EXPECT_FALSE(results[i].relocalization.has_value());  // no verdict where none was asked
        EXPECT_EQ(results[i].fit.points, 0U);
        EXPECT_EQ(results[i].score, 0.0);
    }
    expect_right(results, drive.truth, 20, results.size());
}

TEST(Localizer, BlindWhileTrackingItDrivesOnByOdometry) {
    const TestDrive drive = blinded(part_of(hall().drive, 100, 160), 20, 45);
    Localizer localizer(hall().map, {});
    const auto results = follow(localizer, drive.frames);
    expect_right(results, drive.truth, 1, results.size());
    EXPECT_EQ(results[44].status, LocalizationStatus::kDegraded);
    EXPECT_EQ(results[44].fit.points, 0U);
    EXPECT_EQ(results[44].score, 0.0);
    EXPECT_GT(results[44].covariance.trace(), results[19].covariance.trace());
    EXPECT_EQ(results.back().status, LocalizationStatus::kTracking);
    EXPECT_TRUE(std::none_of(results.begin(), results.end(), [](const auto& r) { return r.jump; }));
}

TEST(Localizer, BlindScansDoNotPutOffTheLookAtAWrongPlace) {
    const TestDrive drive = blinded(part_of(hall().drive, 300, 350), 0, 15);
    Localizer localizer(hall().map, {});
    localizer.start_at(drive.truth.front().pose * Pose2d(-0.8, 0.2, 0.0), kGivenDoubt);
    const auto results = follow(localizer, drive.frames);
    EXPECT_GT((results[14].map_from_robot->translation - drive.truth[14].pose.translation).norm(),
              0.7);
    expect_right(results, drive.truth, 22, results.size());
}

TEST(Localizer, CarriedAwayWhileBlindItSaysSo) {
    const std::size_t places[][2] = {{512, 618}, {124, 53}, {176, 523}};
    for (const auto& [before, after] : places) {
        const TestDrive drive = blinded(spliced(part_of(hall().drive, before - 30, before),
                                                part_of(hall().drive, after - 5, after + 40)),
                                        25, 35);
        Localizer localizer(hall().map, {});
        const auto results = follow(localizer, drive.frames);
        EXPECT_TRUE(std::any_of(results.begin() + 35, results.begin() + 48, [](const auto& result) {
            return result.jump || result.status == LocalizationStatus::kLost;
        })) << before;
        expect_right(results, drive.truth, 50, results.size());
    }
}

TEST(Localizer, ASearchThatEndsEarlyNeverMakesItSure) {
    const TestDrive drive = part_of(hall().drive, 100, 200);
    // Before there is any place, and when the best is found but nobody knows whether others are.
    for (const int effort : {1000, 12000}) {
        LocalizationConfig config;
        config.relocalization.max_nodes = effort;
        Localizer localizer(hall().map, config);
        std::size_t searches = 0;
        for (const LocalizationResult& result : follow(localizer, drive.frames)) {
            EXPECT_EQ(result.status, LocalizationStatus::kRelocalizing);
            EXPECT_FALSE(result.map_from_robot.has_value());
            if (result.relocalization && result.particles == 0) {
                ++searches;
                EXPECT_EQ(result.relocalization->verdict, PlaceVerdict::kUnfinished);
                EXPECT_GT(result.relocalization->nodes, static_cast<std::size_t>(effort));
                EXPECT_EQ(result.score, 0.0);
            } else if (result.relocalization) {
                EXPECT_NE(result.relocalization->verdict, PlaceVerdict::kFound);
                EXPECT_LE(result.score, 0.5 + 1e-9);
            }
        }
        // It asks again while it drives, and now and then, but not in each scan.
        EXPECT_EQ(searches > 0, effort == 1000);
        EXPECT_LE(searches, 15U);
    }
}

/// Where the map ends, what is seen is not in it: no reason to believe in a look-alike elsewhere.
TEST(Localizer, WhereTheMapEndsItDoesNotGoToALookAlike) {
    World ring = world_named("office_ring");
    const std::vector<Pose2d> all = poses_along(ring);
    const auto map =
        reference_of(stored_map_of(ring, {all.begin(), all.begin() + 40}));  // of the first 8 m
    Localizer localizer(map, LocalizationConfig());
    SimulatorConfig config = s300_config(1.0);
    config.scan_rate = 5.0;
    const TestDrive drive = part_of(drive_in(ring, config), 0, 250);
    localizer.start_at(drive.truth.front().pose, kGivenDoubt);
    std::size_t wrong = 0;
    const std::vector<LocalizationResult> results = follow(localizer, drive.frames);
    for (std::size_t i = 0; i < results.size(); ++i) {
        wrong +=
            results[i].status == LocalizationStatus::kTracking &&
                    between(*results[i].map_from_robot, drive.truth[i].pose).translation.norm() >
                        0.5
                ? 1
                : 0;
    }
    EXPECT_EQ(wrong, 0U);
}

}  // namespace
}  // namespace hybrid_slam::test
