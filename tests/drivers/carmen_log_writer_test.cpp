// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "drivers/log_reading.hpp"
#include "hybrid_slam/core/error.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

struct WriteCase {
    const char* name;
    std::size_t beams;
    double first_deg;
    double step_deg;
    const char* line;  ///< that the writer is to use
};

/// Scans with all kinds of readings, each with wheel odometry of its stamp, and one ODOM line
/// between.
std::vector<Measurement> make_drive(const WriteCase& fan) {
    std::vector<Measurement> drive;
    std::mt19937 random(7);
    const float no_return = std::numeric_limits<float>::infinity();
    for (int i = 0; i < 20; ++i) {
        const double stamp = 1700000000.25 + 0.08 * i;
        drive.emplace_back(WheelOdometry{stamp, Pose2d(0.1 * i, -0.2 * i, 3.0 + 0.05 * i)});
        Scan scan;
        scan.stamp = std::round(stamp * 1e6) / 1e6;
        std::get<WheelOdometry>(drive.back()).stamp = scan.stamp;
        scan.angle_min = radians(fan.first_deg);
        scan.angle_increment = radians(fan.step_deg);
        scan.range_min = 0.05;
        scan.range_max = 29.5;
        scan.robot_from_laser = Pose2d(0.8, -0.05, 0.3);
        for (std::size_t beam = 0; beam < fan.beams; ++beam) {
            const float range = static_cast<float>(random() % 40000U) * 0.001F;
            scan.ranges.push_back(beam % 17 == 3 ? no_return : range);
        }
        drive.emplace_back(std::move(scan));
    }
    drive.insert(drive.begin() + 10, WheelOdometry{1700000000.625, Pose2d(0.45, -0.9, -2.0)});
    return drive;
}

class CarmenLogWriterCase : public ::testing::TestWithParam<std::tuple<WriteCase, const char*>> {};

void expect_same(const Measurement& read, const Measurement& written) {
    ASSERT_EQ(read.index(), written.index());
    if (const auto* odometry = std::get_if<WheelOdometry>(&written)) {
        const auto& read_odometry = std::get<WheelOdometry>(read);
        EXPECT_NEAR(read_odometry.stamp, odometry->stamp, 5e-7);
        EXPECT_THAT(read_odometry.odom_from_robot, PoseNear(odometry->odom_from_robot, 1e-8, 1e-8));
        return;
    }
    const Scan& scan = std::get<Scan>(written);
    const Scan& read_scan = std::get<Scan>(read);
    EXPECT_NEAR(read_scan.stamp, scan.stamp, 5e-7);
    EXPECT_NEAR(read_scan.angle_min, scan.angle_min, 1e-6);
    EXPECT_NEAR(read_scan.angle(scan.ranges.size() - 1), scan.angle(scan.ranges.size() - 1), 1e-6);
    EXPECT_EQ(read_scan.range_max, scan.range_max);
    EXPECT_THAT(read_scan.robot_from_laser, PoseNear(scan.robot_from_laser, 1e-8, 1e-8));
    ASSERT_EQ(read_scan.ranges.size(), scan.ranges.size());
    for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
        const bool is_return = scan.is_return(scan.ranges[i]);
        EXPECT_EQ(read_scan.is_return(read_scan.ranges[i]), is_return) << scan.ranges[i];
        EXPECT_TRUE(!is_return || read_scan.ranges[i] == scan.ranges[i]) << scan.ranges[i];
    }
}

TEST_P(CarmenLogWriterCase, ReadsBackTheSame) {
    const auto& [fan, name] = GetParam();
    const ScratchFolder folder;
    const std::vector<Measurement> drive = make_drive(fan);
    CarmenLogWriter writer(folder / name);
    for (const Measurement& measurement : drive) {
        writer.push(measurement);
    }
    writer.close();
    const LogContents log = read_log(folder / name);
    EXPECT_EQ(log.counts.malformed_lines, 0U);
    EXPECT_EQ(log.counts.odometry, 1U) << "the others are in the laser lines";
    ASSERT_EQ(log.measurements.size(), drive.size());
    for (std::size_t i = 0; i < drive.size(); ++i) {
        SCOPED_TRACE(i);
        expect_same(log.measurements[i], drive[i]);
    }
    if (std::string(name) == "drive.clf") {
        EXPECT_THAT(read_bytes(folder / name), HasSubstr(std::string("\n") + fan.line + " "));
    } else {
        EXPECT_EQ(read_bytes(folder / name).substr(0, 2), "\x1f\x8b") << "gzip";
    }
}

INSTANTIATE_TEST_SUITE_P(
    Fans, CarmenLogWriterCase,
    ::testing::Combine(::testing::Values(WriteCase{"sick", 180, -90.0, 1.0, "FLASER"},
                                         WriteCase{"half", 361, -90.0, 0.5, "FLASER"},
                                         WriteCase{"s300", 541, -135.0, 0.5, "FLASER"},
                                         WriteCase{"third", 271, -45.0, 1.0 / 3.0, "FLASER"},
                                         WriteCase{"narrow", 361, -45.0, 0.25, "ROBOTLASER1"},
                                         WriteCase{"aside", 100, -10.0, 0.7, "ROBOTLASER1"}),
                       ::testing::Values("drive.clf", "drive.clf.gz")),
    [](const auto& test) {
        const bool packed = std::string(std::get<1>(test.param)) == "drive.clf.gz";
        return std::string(std::get<0>(test.param).name) + (packed ? "_gzip" : "_plain");
    });

Scan simple_scan(double stamp, std::size_t beams = 180) {
    Scan scan;
    scan.stamp = stamp;
    scan.angle_min = -kPi / 2.0;
    scan.angle_increment = kPi / static_cast<double>(beams);
    scan.range_max = 20.0;
    scan.ranges.assign(beams, 2.5F);
    return scan;
}

TEST(CarmenLogWriter, WithoutWheelOdometryNoneIsReadBackAndTheMountingIsKept) {
    const ScratchFolder folder;
    CarmenLogWriter writer(folder / "a.clf");
    for (int i = 0; i < 3; ++i) {
        Scan scan = simple_scan(i);
        scan.robot_from_laser = Pose2d(0.5, 0.0, 0.1);
        writer.push(scan);
    }
    writer.close();
    const LogContents log = read_log(folder / "a.clf");
    EXPECT_TRUE(log.odometry.empty());
    ASSERT_EQ(log.scans.size(), 3U);
    EXPECT_THAT(log.scans[2].robot_from_laser, PoseNear(Pose2d(0.5, 0.0, 0.1), 1e-8, 1e-8));
}

TEST(CarmenLogWriter, OdometryAfterTheLastScanIsWritten) {
    const ScratchFolder folder;
    CarmenLogWriter writer(folder / "a.clf");
    writer.push(simple_scan(1.0));
    writer.push(WheelOdometry{2.0, Pose2d(1.0, 2.0, 0.5)});
    writer.close();
    EXPECT_EQ(read_log(folder / "a.clf").counts.odometry, 1U);
}

TEST(CarmenLogWriter, WritingWhatWasReadChangesNothing) {
    const ScratchFolder folder;
    const WriteCase fan{"s300", 541, -135.0, 0.5, "FLASER"};
    CarmenLogWriter first(folder / "a.clf");
    for (const Measurement& measurement : make_drive(fan)) {
        first.push(measurement);
    }
    first.close();
    CarmenLogWriter second(folder / "b.clf");
    for (const Measurement& measurement : read_log(folder / "a.clf").measurements) {
        second.push(measurement);
    }
    second.close();
    const LogContents a = read_log(folder / "a.clf");
    const LogContents b = read_log(folder / "b.clf");
    ASSERT_EQ(a.measurements.size(), b.measurements.size());
    for (std::size_t i = 0; i < a.measurements.size(); ++i) {
        SCOPED_TRACE(i);
        expect_same(b.measurements[i], a.measurements[i]);
    }
}

TEST(CarmenLogWriter, RefusesWhatALogCannotHold) {
    const ScratchFolder folder;
    CarmenLogWriter writer(folder / "a.clf");
    writer.push(Image{});  // left out
    EXPECT_THROW(writer.push(simple_scan(1.0, 0)), Error);
    writer.push(simple_scan(1.0));
    Scan turned = simple_scan(2.0);
    turned.angle_min += 0.1;
    EXPECT_THROW(writer.push(turned), Error);
    EXPECT_THROW(CarmenLogWriter(folder / "no" / "such" / "folder.clf"), Error);
}

TEST(CarmenLogWriter, LeavesNoHalfFileWithoutClose) {
    const ScratchFolder folder;
    {
        CarmenLogWriter writer(folder / "a.clf");
        writer.push(simple_scan(1.0));
    }
    EXPECT_FALSE(std::filesystem::exists(folder / "a.clf"));
}

}  // namespace
}  // namespace hybrid_slam::test
