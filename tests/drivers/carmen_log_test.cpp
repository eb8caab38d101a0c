// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/logs/carmen_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "drivers/log_reading.hpp"
#include "hybrid_slam/core/error.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::ElementsAre;
using ::testing::Pair;

constexpr const char* kSamePoses = "1 2 0.5 1 2 0.5";

TEST(CarmenLog, FlaserYieldsWheelOdometryThenTheScan) {
    const LogContents log = read_text(
        "# CARMEN Logfile\n"
        "FLASER 3 1.25 81.9 0.5 1 2 0.5 1 2 0.5 976052857.337530 nohost 0.25\n");
    ASSERT_EQ(log.measurements.size(), 2U);
    const auto& odometry = std::get<WheelOdometry>(log.measurements[0]);
    const Scan& scan = std::get<Scan>(log.measurements[1]);
    EXPECT_EQ(odometry.stamp, 976052857.337530);
    EXPECT_THAT(odometry.odom_from_robot, PoseNear(Pose2d(1, 2, 0.5), 0.0, 0.0));
    EXPECT_EQ(scan.stamp, 976052857.337530);
    EXPECT_THAT(scan.ranges, ElementsAre(1.25F, 81.9F, 0.5F));
    EXPECT_THAT(scan.robot_from_laser, PoseNear(Pose2d(), 0.0, 0.0));
    EXPECT_TRUE(scan.is_return(1.25F));
    EXPECT_FALSE(scan.is_return(81.9F));
    EXPECT_EQ(scan.time_increment, 0.0);
    EXPECT_THAT(log.counts.ignored, ElementsAre(Pair("#", 1)));
}

struct FanCase {
    int beams;
    const char* parameter;
    double first_deg;
    double step_deg;
};

class CarmenLogFan : public ::testing::TestWithParam<FanCase> {};

TEST_P(CarmenLogFan, FollowsTheRule) {
    const FanCase& expected = GetParam();
    const LogContents log = read_text(std::string(expected.parameter) +
                                      old_laser("FLASER", expected.beams, kSamePoses, "1"));
    ASSERT_EQ(log.scans.size(), 1U);
    EXPECT_NEAR(degrees(log.scans[0].angle_min), expected.first_deg, 1e-9);
    EXPECT_NEAR(degrees(log.scans[0].angle_increment), expected.step_deg, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(
    Rule, CarmenLogFan,
    ::testing::Values(FanCase{180, "", -90.0, 1.0}, FanCase{360, "", -90.0, 0.5},
                      FanCase{361, "", -90.0, 0.5}, FanCase{181, "", -90.0, 1.0},
                      FanCase{90, "", -90.0, 2.0}, FanCase{1, "", -90.0, 180.0},
                      FanCase{180, "PARAM laser_front_laser_resolution 0.5 1 h 1\n", -90.0, 1.0},
                      FanCase{541, "PARAM laser_front_laser_resolution 0.5 1 h 1\n", -135.0, 0.5},
                      FanCase{401, "PARAM laser_front_laser_resolution 0.25\n", -50.0, 0.25},
                      FanCase{90, "PARAM laser_front_laser_resolution -1\n", -90.0, 2.0},
                      FanCase{90, "PARAM laser_front_laser_resolution nan\n", -90.0, 2.0},
                      FanCase{541, "PARAM laser_front_laser_resolution 90\n", -90.0, 1.0 / 3.0}));

TEST(CarmenLog, MountingIsTheRobotPoseInvertedTimesTheLaserPose) {
    const Pose2d odom_from_robot(-3.0, 8.25, 2.5);
    const Pose2d robot_from_laser(0.3, -0.1, 0.2);
    const Pose2d odom_from_laser = odom_from_robot * robot_from_laser;
    const std::string poses = std::to_string(odom_from_laser.x()) + " " +
                              std::to_string(odom_from_laser.y()) + " " +
                              std::to_string(odom_from_laser.heading) + " -3.0 8.25 2.5";
    const LogContents log = read_text(old_laser("FLASER", 180, poses, "1"));
    EXPECT_THAT(log.scans.at(0).robot_from_laser, PoseNear(robot_from_laser, 2e-6, 2e-6));
}

TEST(CarmenLog, MountingDoesNotJitterButFollowsARealChange) {
    const LogContents log = read_text(old_laser("FLASER", 180, "0.100 0 0 0 0 0", "1") +
                                      old_laser("FLASER", 180, "1.101 0 0 1 0 0", "2") +
                                      old_laser("FLASER", 180, "1.110 0 0 1 0 0", "3"));
    ASSERT_EQ(log.scans.size(), 3U);
    EXPECT_EQ(log.scans[0].robot_from_laser.x(), 0.1);
    EXPECT_EQ(log.scans[1].robot_from_laser.x(), 0.1);
    EXPECT_NEAR(log.scans[2].robot_from_laser.x(), 0.11, 1e-12);
    EXPECT_EQ(log.counts.bad_poses, 0U);
}

TEST(CarmenLog, PosesFarApartOrNotFiniteAreCountedAndTheScanIsKept) {
    const LogContents log = read_text(old_laser("FLASER", 180, "0.1 0 0 0 0 0.01", "1") +
                                      old_laser("FLASER", 180, "9 9 0 0 0 0", "2") +
                                      old_laser("FLASER", 180, "nan 0 0 0 0 0", "3") +
                                      old_laser("FLASER", 180, "0 0 0 1e300 0 0", "4"));
    ASSERT_EQ(log.scans.size(), 4U);
    EXPECT_THAT(log.scans[1].robot_from_laser, PoseNear(Pose2d(), 0.0, 0.0));
    EXPECT_EQ(log.counts.bad_poses, 3U);
    EXPECT_EQ(log.odometry.size(), 2U) << "lines 3 and 4 have no pose to give";
}

TEST(CarmenLog, ZeroPosesThroughoutAreNoOdometry) {
    const std::string zero = old_laser("FLASER", 180, "0.2 0 0 0 0 0", "1");
    const LogContents without = read_text(zero + zero);
    EXPECT_EQ(without.scans.size(), 2U);
    EXPECT_TRUE(without.odometry.empty());
    EXPECT_EQ(without.scans[0].robot_from_laser.x(), 0.2);
    const LogContents with = read_text(zero + old_laser("FLASER", 180, "0.2 0 0.1 0 0 0.1", "2"));
    EXPECT_EQ(with.odometry.size(), 2U) << "a drive that begins at the origin";
}

TEST(CarmenLog, OdomLinesAreYieldedInOrderUnlessTurnedOff) {
    const std::string text = "ODOM 1 2 3 0.1 0.2 0 10.5 host 0\n" +
                             old_laser("FLASER", 180, kSamePoses, "10.6") +
                             "ODOM 4 5 6.5 0.1 0.2 0 10.7\n";
    const LogContents log = read_text(text);
    ASSERT_EQ(log.odometry.size(), 3U);
    EXPECT_THAT(log.odometry[0].odom_from_robot, PoseNear(Pose2d(1, 2, 3), 0.0, 0.0));
    EXPECT_EQ(log.odometry[0].stamp, 10.5);
    EXPECT_NEAR(log.odometry[2].odom_from_robot.heading, 6.5 - 2.0 * kPi, 1e-12);
    EXPECT_EQ(log.counts.odometry, 2U);

    CarmenLogConfig config;
    config.use_odom_lines = false;
    const LogContents quiet = read_text(text, config);
    EXPECT_EQ(quiet.odometry.size(), 1U);
    EXPECT_EQ(quiet.counts.odometry, 2U) << "still counted";
}

/// type start fov resolution max accuracy remission n ranges
constexpr const char* kSensor = " 2 -2.0 4.0 1.0 5.6 0.01 0 5 1.0 2.0 5.6 inf 4.0";
constexpr const char* kTrailer = " 1500.25 myhost 0.5\n";

void expect_five_beams(const LogContents& log) {
    ASSERT_EQ(log.scans.size(), 1U);
    const Scan& scan = log.scans[0];
    EXPECT_EQ(scan.stamp, 1500.25);
    EXPECT_EQ(scan.angle_min, -2.0);
    EXPECT_EQ(scan.angle_increment, 1.0);
    EXPECT_EQ(scan.ranges.size(), 5U);
    EXPECT_FALSE(scan.is_return(scan.ranges[2])) << "5.6 is the maximum that the line tells";
    EXPECT_EQ(log.counts.no_returns, 2U);
    EXPECT_EQ(log.counts.not_finite, 1U);
}

TEST(CarmenLog, RobotlaserOfBothVintages) {
    const std::string poses = " 1.1 2 0 1 2 0";
    const std::string speeds = " 0.3 0.1 0.4 0.5";
    const std::string head = std::string("ROBOTLASER1") + kSensor;
    const std::vector<std::string> vintages{
        head + poses + speeds + kTrailer,                        // the old one
        head + " 0" + poses + speeds + " 1000000.0" + kTrailer,  // no remissions
        head + " 5 7 7 7 7 7" + poses + speeds + " 1000000.0" + kTrailer,
        head + " 5 7 7 7 7 7" + poses + speeds + kTrailer,  // no turn axis
    };
    for (const std::string& text : vintages) {
        SCOPED_TRACE(text);
        const LogContents log = read_text(text);
        expect_five_beams(log);
        ASSERT_EQ(log.odometry.size(), 1U);
        EXPECT_THAT(log.odometry[0].odom_from_robot, PoseNear(Pose2d(1, 2, 0), 0.0, 0.0));
        EXPECT_NEAR(log.scans[0].robot_from_laser.x(), 0.1, 1e-12);
    }
}

TEST(CarmenLog, RawlaserHasNoPoses) {
    const LogContents log = read_text("ODOM 1 2 0 0 0 0 1500.2 h 0\n" + std::string("RAWLASER1") +
                                      kSensor + " 0" + kTrailer);
    expect_five_beams(log);
    EXPECT_EQ(log.odometry.size(), 1U);
    EXPECT_EQ(log.counts.bad_poses, 0U);
    expect_five_beams(read_text(std::string("RAWLASER2") + kSensor + kTrailer));
}

struct ChoiceCase {
    std::vector<const char*> words;
    const char* chosen;
};

class CarmenLogChoice : public ::testing::TestWithParam<ChoiceCase> {};

std::string laser_line(const std::string& word) {
    if (word.find("RAW") == 0) {
        return word + kSensor + " 0" + kTrailer;
    }
    if (word.find("ROBOT") == 0) {
        return word + kSensor + " 0 1 2 0 1 2 0 0 0 0 0 0" + kTrailer;
    }
    return old_laser(word, 4, kSamePoses, "1500.25");
}

TEST_P(CarmenLogChoice, DeliversOneLaserAndCountsTheOthers) {
    std::string text;
    for (const char* word : GetParam().words) {
        text += laser_line(word);
    }
    const LogContents log = read_text(text + text);
    EXPECT_EQ(log.counts.scans, 2U);
    EXPECT_EQ(log.counts.ignored.count(GetParam().chosen), 0U);
    EXPECT_EQ(log.counts.ignored.size(), GetParam().words.size() - 1);
    for (const auto& [word, count] : log.counts.ignored) {
        EXPECT_EQ(count, 2U) << word;
    }
}

INSTANTIATE_TEST_SUITE_P(
    Rank, CarmenLogChoice,
    ::testing::Values(ChoiceCase{{"FLASER", "RLASER"}, "FLASER"},
                      ChoiceCase{{"RLASER", "FLASER"}, "FLASER"}, ChoiceCase{{"RLASER"}, "RLASER"},
                      ChoiceCase{{"LASER3"}, "LASER3"},
                      ChoiceCase{{"RAWLASER1", "ROBOTLASER1"}, "ROBOTLASER1"},
                      ChoiceCase{{"RAWLASER1", "RAWLASER2", "FLASER"}, "FLASER"},
                      ChoiceCase{{"RAWLASER2", "RAWLASER1"}, "RAWLASER1"},
                      ChoiceCase{{"ROBOTLASER2", "ROBOTLASER1"}, "ROBOTLASER1"},
                      ChoiceCase{{"ROBOTLASER1", "FLASER"}, "ROBOTLASER1"},
                      ChoiceCase{{"FLASER", "ROBOTLASER1"}, "FLASER"}));

TEST(CarmenLog, RearLaserLooksBack) {
    const LogContents log = read_text(old_laser("RLASER", 180, "0.9 2 3.141593 1 2 0", "1"));
    EXPECT_THAT(log.scans.at(0).robot_from_laser, PoseNear(Pose2d(-0.1, 0.0, kPi), 1e-6, 1e-6));
}

TEST(CarmenLog, MaximumOfTheLogCountsWhenItIsTheSmaller) {
    const std::string scan = "FLASER 4 7.99 8.0 49.9 50.0 1 1 0 1 1 0 1 h 0\n";
    EXPECT_EQ(read_text(scan).counts.no_returns, 1U);
    EXPECT_EQ(read_text("PARAM robot_front_laser_max 8.0 1 h 1\n" + scan).counts.no_returns, 3U);
    EXPECT_EQ(read_text("PARAM robot_front_laser_max 81.9 1 h 1\n" + scan).counts.no_returns, 1U);
    CarmenLogConfig config;
    config.range_min = 7.995;
    config.range_max = 100.0;
    EXPECT_EQ(read_text(scan, config).counts.no_returns, 1U) << "the one that is too near";
}

TEST(CarmenLog, StampsThatRunBackOrRepeatAreCountedAndTheOrderIsKept) {
    std::string text;
    for (const char* stamp : {"10.0", "10.2", "10.1", "10.1", "-3.0", "10.4"}) {
        text += old_laser("FLASER", 180, kSamePoses, stamp);
    }
    const LogContents log = read_text(text);
    EXPECT_EQ(log.counts.backward_stamps, 2U);
    EXPECT_EQ(log.counts.duplicate_stamps, 1U);
    EXPECT_EQ(log.scans.at(4).stamp, -3.0);
}

TEST(CarmenLog, TakesTabsCarriageReturnsAndBlankLines) {
    const LogContents log = read_text(
        "\r\n  \nFLASER\t2  1.5\t2.5 1 2 0 1 2 0 7.5 host 0.5\r\nODOM 1 2 0 0 0 0 8 h 0\r\n");
    EXPECT_EQ(log.counts.scans, 1U);
    EXPECT_EQ(log.counts.odometry, 1U);
    EXPECT_EQ(log.counts.lines, 4U);
    EXPECT_EQ(log.counts.malformed_lines, 0U);
}

TEST(CarmenLog, NumbersOfAllSpellingsReadAsStrtodReadsThem) {
    const std::vector<const char*> numbers{
        "1.07",    "0.1",  ".5", "5.",     "12345.678901",      "1e1",           "2.5E-1",
        "000.250", "+1.5", "3",  "0.0001", "49.99999999999999", "1.17549435e-38"};
    std::string line = "FLASER " + std::to_string(numbers.size());
    for (const char* number : numbers) {
        line += std::string(" ") + number;
    }
    const LogContents log = read_text(line + " 1 1 0 1 1 0 1 h 0\n");
    ASSERT_EQ(log.scans.size(), 1U);
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        EXPECT_EQ(log.scans[0].ranges[i], static_cast<float>(std::strtod(numbers[i], nullptr)))
            << numbers[i];
    }
}

TEST(CarmenLog, ProgressRunsToOne) {
    const ScratchFolder folder;
    CarmenLog log(folder.write("a.clf", old_laser("FLASER", 180, kSamePoses, "1")));
    while (log.next()) {
    }
    EXPECT_EQ(log.progress(), 1.0);
    EXPECT_EQ(log.next(), std::nullopt);
}

}  // namespace
}  // namespace hybrid_slam::test
