// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "drivers/log_reading.hpp"
#include "hybrid_slam/core/error.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;

constexpr const char* kGood = "FLASER 3 1.0 2.0 3.0 1 2 0 1 2 0 10.5 host 0.5\n";

class CarmenLogMalformed : public ::testing::TestWithParam<const char*> {};

TEST_P(CarmenLogMalformed, LineIsSkippedAndCounted) {
    const LogContents log = read_text(std::string(kGood) + GetParam() + "\n" + kGood);
    EXPECT_EQ(log.counts.scans, 2U);
    EXPECT_EQ(log.counts.malformed_lines, 1U);
    EXPECT_EQ(log.counts.torn_last_line, 0U);
    EXPECT_EQ(log.scans.size(), 2U);
}

INSTANTIATE_TEST_SUITE_P(
    Flaser, CarmenLogMalformed,
    ::testing::Values("FLASER", "FLASER 3", "FLASER 0 1 2 0 1 2 0 10 h 0",
                      "FLASER -1 1.0 1 2 0 1 2 0 10 h 0", "FLASER x 1.0 1 2 0 1 2 0 10 h 0",
                      "FLASER 2.0 1.0 1.0 1 2 0 1 2 0 10 h 0",
                      "FLASER 9999999999999999999 1 2 0 1 2 0 10 h 0",
                      "FLASER 9223372036854775807 1 2 0 1 2 0 10 h 0",
                      "FLASER 2 1.0 2.0 3.0 4.0 1 2 0 1 2 0 10 h 0",  // more readings than told
                      "FLASER 4 1.0 2.0 1 2 0 1 2 0 10 h 0",          // fewer
                      "FLASER 2 1.0 abc 1 2 0 1 2 0 10 h 0",
                      "FLASER 2 1.0 1.0.0 1 2 0 1 2 0 10 h 0", "FLASER 2 1.0 . 1 2 0 1 2 0 10 h 0",
                      "FLASER 2 1.0 1,5 1 2 0 1 2 0 10 h 0", "FLASER 2 1.0 0x1 1 2 0 1 2 0 10 h 0",
                      "FLASER 2 1.0 2.0 a b c d e f 10 h 0", "FLASER 2 1.0 2.0 1 2 0 1 2 0 nan h 0",
                      "FLASER 2 1.0 2.0 1 2 0 1 2 0 1e30 h 0",
                      "FLASER 2 1.0 2.0 1 2 0 1 2 0 host h 0"));

INSTANTIATE_TEST_SUITE_P(Others, CarmenLogMalformed,
                         ::testing::Values("ODOM", "ODOM 1 2", "ODOM 1 2 3 0 0 0 abc h 0",
                                           "ODOM 1 nan 3 0 0 0 5 h 0", "ODOM 1 2 3 0 0 0 inf h 0",
                                           "ODOM 1e9 2 3 0 0 0 5 h 0",
                                           "ODOM 1 2 3 0 0 0 5 h 0 more", "PARAM", "PARAM name"));

class CarmenLogMalformedRobot : public ::testing::TestWithParam<const char*> {};

TEST_P(CarmenLogMalformedRobot, LineIsSkippedAndCounted) {
    const std::string good = "ROBOTLASER1 0 -1 2 1 80 0 0 2 1.0 2.0 1 2 0 1 2 0 0 0 0 0 9 h 0\n";
    const LogContents log = read_text(good + GetParam() + "\n" + good);
    EXPECT_EQ(log.counts.scans, 2U);
    EXPECT_EQ(log.counts.malformed_lines, 1U);
}

INSTANTIATE_TEST_SUITE_P(
    Lines, CarmenLogMalformedRobot,
    ::testing::Values("ROBOTLASER1", "ROBOTLASER1 0 -1 2 1 80 0 0",
                      "ROBOTLASER1 0 -1 2 1 80 0 0 2 1.0 2.0 9 h 0",
                      "ROBOTLASER1 0 -1 2 1 80 0 0 2 1.0 2.0 7 1 2 0 1 2 0 0 0 0 0 9 h 0",
                      "ROBOTLASER1 0 -1 2 1 80 0 0 9999999 1.0 2.0 1 2 0 1 2 0 0 0 0 0 9 h 0",
                      "ROBOTLASER1 0 -1 2 x 80 0 0 2 1.0 2.0 1 2 0 1 2 0 0 0 0 0 9 h 0",
                      "ROBOTLASER1 0 -1 2 1 80 0 0 2 1.0 2.0 1 2 0 1 2 0 0 0 0 0 h 9 0"));

TEST(CarmenLogBroken, SensorFieldsThatMakeNoSenseFallBackToTheRule) {
    const LogContents log =
        read_text("ROBOTLASER1 0 nan 2 0 -5 0 0 4 1 2 3 4 1 2 0 1 2 0 0 0 0 0 9 h 0\n");
    ASSERT_EQ(log.scans.size(), 1U);
    EXPECT_EQ(log.scans[0].angle_min, -kPi / 2.0);
    EXPECT_EQ(log.scans[0].angle_increment, kPi / 4.0);
    EXPECT_EQ(log.scans[0].range_max, 50.0);
}

TEST(CarmenLogBroken, ReadingsThatAreNoDistances) {
    const LogContents log =
        read_text("FLASER 8 inf -inf nan NaN 1e30 1e300 -1.0 1.0 1 2 0 1 2 0 10.5 host 0.5\n");
    ASSERT_EQ(log.scans.size(), 1U);
    EXPECT_EQ(log.counts.beams, 8U);
    EXPECT_EQ(log.counts.no_returns, 7U);
    EXPECT_EQ(log.counts.not_finite, 5U) << "1e300 is infinite as a float";
}

/// A line cut anywhere never yields a scan with a wrong stamp, and never counts as malformed.
TEST(CarmenLogBroken, TornLastLine) {
    const std::vector<std::string> lines{
        "FLASER 3 1.0 2.0 3.0 1 2 0 1 2 0 1010.5 host 0.75",
        "ROBOTLASER1 0 -1 2 1 80 0 0 2 1.0 2.0 0 1 2 0 1 2 0 0 0 0 0 0.5 1010.5 host 0.75",
        "ROBOTLASER1 0 -1 2 1 80 0 0 2 1.0 2.0 1 2 0 1 2 0 0 0 0 0 1010.5 host 0.75",
        "RAWLASER1 0 -1 2 1 80 0 0 2 1.0 2.0 0 1010.5 host 0.75",
        "ODOM 1 2 3 0.1 0.2 0 1010.5 host 0.75",
    };
    for (const std::string& line : lines) {
        const std::string first = line[0] == 'O' ? kGood : line + "\n";
        for (std::size_t length = 1; length <= line.size(); ++length) {
            const std::string torn = line.substr(0, length);
            SCOPED_TRACE(torn);
            const LogContents log = read_text(first + torn);
            ASSERT_FALSE(log.measurements.empty());
            EXPECT_EQ(log.counts.malformed_lines, 0U);
            for (const Scan& scan : log.scans) {
                EXPECT_TRUE(scan.stamp == 1010.5 || scan.stamp == 10.5) << scan.stamp;
            }
            for (const WheelOdometry& odometry : log.odometry) {
                EXPECT_TRUE(odometry.stamp == 1010.5 || odometry.stamp == 10.5) << odometry.stamp;
            }
            const bool word_is_torn = torn.find(' ') == std::string::npos;
            const std::size_t taken = log.scans.size() + log.counts.odometry - 1;
            EXPECT_TRUE(word_is_torn || taken + log.counts.torn_last_line == 1U);
        }
        EXPECT_EQ(read_text(first + line).counts.torn_last_line, 0U) << "only its end is missing";
    }
}

TEST(CarmenLogBroken, TruncatedGzipYieldsWhatIsThereAndSaysSo) {
    const ScratchFolder folder;
    {
        CarmenLogWriter writer(folder / "whole.clf.gz");
        std::mt19937 random(3);
        for (int i = 0; i < 200; ++i) {
            Scan scan;
            scan.stamp = i;
            scan.angle_min = -kPi / 2.0;
            scan.angle_increment = kPi / 180.0;
            scan.range_max = 30.0;
            for (int beam = 0; beam < 180; ++beam) {
                scan.ranges.push_back(1.0F + static_cast<float>(random() % 1000U) * 0.01F);
            }
            writer.push(scan);
        }
        writer.close();
    }
    const std::string bytes = read_bytes(folder / "whole.clf.gz");
    const auto cut = folder.write("cut.clf.gz", bytes.substr(0, bytes.size() / 2));
    const LogContents log = read_log(cut);
    EXPECT_GT(log.scans.size(), 50U);
    EXPECT_LT(log.scans.size(), 150U);
    EXPECT_EQ(log.counts.torn_last_line, 1U);
    EXPECT_EQ(log.counts.malformed_lines, 0U);
}

std::string error_of(const std::filesystem::path& file) {
    try {
        const CarmenLog log(file);
    } catch (const Error& error) {
        return error.what();
    }
    return "no error";
}

TEST(CarmenLogBroken, WhatIsNoLogIsRefusedInOneLine) {
    const ScratchFolder folder;
    EXPECT_THAT(error_of(folder / "missing.clf"), HasSubstr("missing.clf"));
    EXPECT_THAT(error_of(folder / ""), HasSubstr("directory"));
    EXPECT_THAT(error_of(folder.write("empty.clf", "")), HasSubstr("no CARMEN log"));
    EXPECT_THAT(error_of(folder.write("a.txt", "hello\nworld\n")),
                HasSubstr("a.txt: no CARMEN log"));
    EXPECT_THAT(error_of(folder.write("b.clf", "PARAM a b\nODOM 1 2 3 0 0 0 5 h 0\nFLASER 2 1\n")),
                HasSubstr("no CARMEN log"));
    std::string binary(100000, '\0');
    std::mt19937 random(1);
    std::generate(binary.begin(), binary.end(), [&random] { return static_cast<char>(random()); });
    EXPECT_THAT(error_of(folder.write("c.bin", binary)), HasSubstr("no CARMEN log"));
    // A log that begins after a thousand lines of something else is not looked for.
    std::string late;
    for (int i = 0; i < 1000; ++i) {
        late += "1 2 3\n";
    }
    EXPECT_THAT(error_of(folder.write("d.txt", late + kGood)), HasSubstr("no CARMEN log"));
}

TEST(CarmenLogBroken, ManyKindsOfForeignLinesAreCountedInBoundedMemory) {
    std::string text = kGood;
    for (int i = 0; i < 5000; ++i) {
        text += "WORD" + std::to_string(i) + " 1 2 3\n";
    }
    text += std::string(100000, 'x') + "\n\x01\xff\n";
    const LogContents log = read_text(text);
    EXPECT_LE(log.counts.ignored.size(), 101U);
    std::size_t total = 0;
    for (const auto& [word, count] : log.counts.ignored) {
        EXPECT_LE(word.size(), 32U);
        total += count;
    }
    EXPECT_EQ(total, 5002U);
}

/// Whatever happens to the bytes of a log, it is read to its end, every line is accounted for and
/// no measurement holds a stamp or a pose that is not finite.
void expect_survives(const ScratchFolder& folder, const std::string& bytes) {
    const auto file = folder.write("flipped.clf", bytes);
    LogContents log;
    try {
        log = read_log(file);
    } catch (const Error&) {
        return;  // nothing left of it that looks like a log
    }
    EXPECT_EQ(log.counts.scans, log.scans.size());
    for (const Scan& scan : log.scans) {
        EXPECT_TRUE(std::isfinite(scan.stamp));
        EXPECT_TRUE(scan.robot_from_laser.vector().allFinite());
        EXPECT_GT(scan.angle_increment, 0.0);
    }
    for (const WheelOdometry& odometry : log.odometry) {
        EXPECT_TRUE(odometry.odom_from_robot.vector().allFinite());
    }
}

TEST(CarmenLogBroken, SurvivesFlippedBytes) {
    const std::string seed =
        "# CARMEN Logfile\nPARAM laser_front_laser_resolution 0.5 1 h 1\n"
        "PARAM robot_front_laser_max 20 1 h 1\nODOM 1 2 3 0.1 0.2 0 10.4 host 0\n" +
        std::string(kGood) + old_laser("RLASER", 4, "1 2 3 1 2 0", "10.55") +
        "ROBOTLASER1 0 -1 2 1 80 0 0 2 1.0 2.0 2 5 6 1 2 0 1 2 0 0 0 0 0 0.5 10.6 host 0.75\n"
        "RAWLASER1 0 -1 2 1 80 0 0 2 1.0 2.0 0 10.6 host 0.75\n" +
        kGood;
    const ScratchFolder folder;
    std::mt19937 random(42);
    constexpr std::string_view kLikely = " \n0123456789.-+eEnaifFLASERODM\0\xff\x1f\x8b";
    for (int round = 0; round < 3000; ++round) {
        std::string bytes = seed;
        for (unsigned flips = 1 + random() % 8; flips > 0; --flips) {
            const std::size_t at = random() % bytes.size();
            switch (random() % 4) {
                case 0:
                    bytes[at] = static_cast<char>(random());
                    break;
                case 1:
                    bytes[at] = kLikely[random() % kLikely.size()];
                    break;
                case 2:
                    bytes.erase(at, 1 + random() % 10);
                    break;
                default:
                    bytes.insert(at, 1, kLikely[random() % kLikely.size()]);
            }
            if (bytes.empty()) {
                break;
            }
        }
        SCOPED_TRACE(round);
        ASSERT_NO_THROW(expect_survives(folder, bytes));
    }
}

TEST(CarmenLog, PipeIsRefusedAtOnce) {
    const TempFolder folder;
    const std::filesystem::path pipe = folder / "log.clf";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    EXPECT_THAT(error_of(pipe), HasSubstr("log.clf: is a pipe"));
}

}  // namespace
}  // namespace hybrid_slam::test
