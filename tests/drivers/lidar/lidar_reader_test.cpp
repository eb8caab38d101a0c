// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/lidar/lidar_reader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <random>

#include "scans.hpp"
#include "support/shared_data.hpp"

namespace hybrid_slam {
namespace {

using namespace test;  // NOLINT
using ::testing::ElementsAre;
using ::testing::FloatEq;
using ::testing::IsNan;

constexpr float kNothing = HUGE_VALF;

/// The one scan that these words give.
Scan scan_of(const LidarConfig& config, const S300Telegram& telegram) {
    LidarReader reader(config);
    std::vector<Scan> scans = scans_of(reader, encode(telegram));
    EXPECT_EQ(scans.size(), 1U);
    return scans.empty() ? Scan() : scans[0];
}

TEST(LidarReader, WordsBecomeMetresAndFlags) {
    S300Telegram telegram =
        telegram_of(2, {150, 0x2000 | 151, 0x4000 | 152, 0x8000 | 153, 0, 2949, 2950, 2996, 3});
    const Scan scan = scan_of({}, telegram);
    EXPECT_THAT(scan.ranges,
                ElementsAre(FloatEq(1.5F), FloatEq(1.51F), FloatEq(1.52F), FloatEq(1.53F), IsNan(),
                            FloatEq(29.49F), kNothing, kNothing, FloatEq(0.03F)));
    EXPECT_FALSE(scan.is_return(scan.ranges[8]));  // below range_min, but told
    EXPECT_THAT(scan.flags,
                ElementsAre(0, int{kReflector}, int{kProtectiveField}, 0, 0, 0, 0, 0, 0));
    telegram.protocol = 0x0102;
    EXPECT_EQ(scan_of({}, telegram).flags[3], kWarningField);
}

TEST(LidarReader, WhatTheDeviceSaysOfNothingMeasuredIsNoWall) {
    LidarConfig config;
    config.range_max = 40.0;
    const Scan scan =
        scan_of(config, telegram_of(2, {2995, 2996, 0x4000 | 2996, 2997, 3999, 4000}));
    EXPECT_THAT(scan.ranges, ElementsAre(FloatEq(29.95F), kNothing, kNothing, FloatEq(29.97F),
                                         FloatEq(39.99F), kNothing));
    EXPECT_EQ(scan.flags[2], kProtectiveField);
}

TEST(LidarReader, BeamsLieSymmetricToTheMiddleAndCounterClockwise) {
    LidarConfig config;
    config.x = 0.4;
    config.yaw = 0.1;
    config.angle_offset = radians(10.0);
    const Scan scan = scan_of(config, telegram_of(2, level_words(541)));
    EXPECT_NEAR(scan.angle_min, radians(-125.0), 1e-12);
    EXPECT_NEAR(scan.angle(540), radians(145.0), 1e-12);
    EXPECT_NEAR(scan.time_increment, 0.040 / 720.0, 1e-15);
    EXPECT_EQ(scan.robot_from_laser.translation.x(), 0.4);
    EXPECT_EQ(scan.robot_from_laser.heading, 0.1);
    EXPECT_EQ(scan.range_max, config.range_max);
    EXPECT_NEAR(scan_of({}, telegram_of(2, level_words(1))).angle_min, 0.0, 1e-15);
}

TEST(LidarReader, UpsideDownTheFirstBeamIsLeftmost) {
    LidarConfig config;
    config.upside_down = true;
    config.blind_sectors_deg = {134.0, 135.0};
    const Scan scan = scan_of(config, telegram_of(2, level_words(541)));
    EXPECT_NEAR(scan.angle_min, radians(135.0), 1e-12);
    EXPECT_NEAR(scan.angle(540), radians(-135.0), 1e-12);
    EXPECT_GT(scan.time_increment, 0.0);
    EXPECT_THAT(std::vector<float>(scan.ranges.begin(), scan.ranges.begin() + 4),
                ElementsAre(IsNan(), IsNan(), IsNan(), FloatEq(5.0F)))
        << "nobody looked there";
}

/// The whole degrees at which a fan of 361 degrees sees nothing.
std::vector<int> blind_degrees(const std::vector<double>& sectors) {
    LidarConfig config;
    config.angle_step = radians(1.0);
    config.blind_sectors_deg = sectors;
    const Scan scan = scan_of(config, telegram_of(2, level_words(361)));
    std::vector<int> blind;
    for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
        if (!scan.is_return(scan.ranges[i])) {
            blind.push_back(static_cast<int>(std::lround(degrees(scan.angle(i)))));
        }
    }
    return blind;
}

TEST(LidarReader, BlindSectorsSeeNothing) {
    EXPECT_THAT(blind_degrees({}), ElementsAre());
    EXPECT_THAT(blind_degrees({-2.0, 1.0, 90.0, 90.0}), ElementsAre(-2, -1, 0, 1, 90));
    EXPECT_THAT(blind_degrees({179.0, -178.0}), ElementsAre(-180, -179, -178, 179, 180));
    EXPECT_THAT(blind_degrees({179.0, 182.0}), ElementsAre(-180, -179, -178, 179, 180));
    EXPECT_EQ(blind_degrees({1.0, 0.0}).size(), 361U);  // all the way round, in whole degrees
    EXPECT_EQ(blind_degrees({-180.0, 180.0}).size(), 361U);
}

TEST(LidarReader, BlindSectorsFollowTheNumberOfBeams) {
    LidarConfig config;
    config.blind_sectors_deg = {0.0, 0.0};
    LidarReader reader(config);
    const std::vector<Scan> scans =
        scans_of(reader, joined({encode(telegram_of(2, level_words(541))),
                                 encode(telegram_of(4, level_words(381)))}));
    ASSERT_EQ(scans.size(), 2U);
    EXPECT_FALSE(scans[0].is_return(scans[0].ranges[270]));
    EXPECT_FALSE(scans[1].is_return(scans[1].ranges[190]));
    EXPECT_EQ(reader.counts().no_returns, 2U);
    EXPECT_EQ(reader.counts().beams, 541U + 381U);
}

TEST(LidarReader, AStampIsTheLastBytesArrivalLessWireTimeAndLatency) {
    LidarConfig config;
    config.baud = 250000;
    config.latency = 0.03;
    LidarReader reader(config);
    const Bytes bytes = encode(telegram_of(2, level_words(541)));
    const auto part = [&](std::size_t from, std::size_t to) {
        return Bytes(bytes.begin() + static_cast<std::ptrdiff_t>(from),
                     bytes.begin() + static_cast<std::ptrdiff_t>(to));
    };
    EXPECT_TRUE(scans_of(reader, part(0, 500), kEpoch + 1.0).empty());
    EXPECT_TRUE(scans_of(reader, part(500, 1107), kEpoch + 2.0).empty());
    reader.push({kEpoch + 3.0, part(1107, 1108)});
    reader.push({kEpoch + 4.0, {1, 2, 3}});
    reader.push({kEpoch + 5.0, {}});
    const std::optional<Scan> scan = reader.next();
    ASSERT_TRUE(scan.has_value());
    EXPECT_NEAR(scan->stamp, kEpoch + 3.0 - 0.04432 - 0.03, 1e-6);
}

/// Bytes as they come from the line in pieces, 10 minutes of them.
TEST(LidarReader, JitterDoesNotReachTheStamps) {
    const LidarConfig config;
    LidarReader reader(config);
    std::mt19937 rng(7);
    std::uniform_real_distribution<double> delay(0.0, 0.03);
    const double spent = config.wire_time(1108) + config.latency;
    std::size_t scans = 0;
    Bytes rest;
    for (std::uint32_t i = 0; i < 7500; ++i) {
        const double truth = kEpoch + 0.0801 * i;
        const Bytes bytes = encode(telegram_of(2 * i, level_words(541)));
        const auto cut = static_cast<std::ptrdiff_t>(1 + rng() % 1000);
        scans += scans_of(reader, joined({rest, Bytes(bytes.begin(), bytes.begin() + cut)}), truth)
                     .size();
        rest.assign(bytes.begin() + cut, bytes.end());
        const std::size_t end = rest.size();
        append(rest, Bytes(i % 3, 0x55));  // noise of the line
        const std::vector<Scan> ready =
            scans_of(reader, Bytes(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(end)),
                     truth + spent + delay(rng));
        rest.erase(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(end));
        ASSERT_EQ(ready.size(), 1U);
        ++scans;
        if (i > 750) {
            ASSERT_NEAR(ready[0].stamp, truth, 1e-3) << i;
        }
    }
    EXPECT_EQ(scans, 7500U);
    EXPECT_EQ(reader.counts().scans, 7500U);
    EXPECT_EQ(reader.counts().missed_scans, 0U);
    EXPECT_NEAR(reader.count_period(), 0.04005, 1e-6);
}

TEST(LidarReader, StandbyAndLockOutAreCountedAndNotGiven) {
    LidarReader reader(LidarConfig{});
    S300Telegram locked = telegram_of(6);
    locked.status = 0x0100;
    std::vector<std::uint16_t> nearly = level_words(541, kS300Standby);
    nearly[540] = 0x4005;
    const std::vector<Scan> scans = scans_of(
        reader, joined({encode(telegram_of(2, level_words(541, kS300Standby))),
                        encode(telegram_of(4, nearly)), encode(locked), encode(telegram_of(8))}));
    ASSERT_EQ(scans.size(), 2U);
    EXPECT_TRUE(scans[0].has(kProtectiveField));
    EXPECT_EQ(reader.counts().scans, 2U);
    EXPECT_EQ(reader.counts().standby_scans, 1U);
    EXPECT_EQ(reader.counts().lockout_telegrams, 1U);
    EXPECT_EQ(reader.counts().protective_scans, 1U);
    EXPECT_EQ(reader.counts().warning_scans, 0U);
    EXPECT_EQ(reader.counts().missed_scans, 0U);
}

/// More than the decoder may look back on, and only then fetched.
TEST(LidarReader, ScansFetchedLateKeepTheirArrivals) {
    LidarReader prompt(LidarConfig{});
    LidarReader late(LidarConfig{});
    std::vector<double> expected;
    for (std::uint32_t i = 0; i < 300; ++i) {
        const LidarBytes bytes{kEpoch + 0.08 * i, encode(telegram_of(2 * i, level_words(541)))};
        expected.push_back(scans_of(prompt, bytes.bytes, bytes.arrival).at(0).stamp);
        late.push(bytes);
    }
    std::vector<double> stamps;
    while (const std::optional<Scan> scan = late.next()) {
        stamps.push_back(scan->stamp);
    }
    EXPECT_EQ(stamps, expected);
}

TEST(LidarReader, TheCounterMayWrap) {
    LidarReader reader(LidarConfig{});
    for (std::uint32_t i = 0; i < 10; ++i) {
        scans_of(reader, encode(telegram_of(0xFFFFFFF6U + 2 * i)), kEpoch + 0.08 * i);
    }
    EXPECT_EQ(reader.counts().scans, 10U);
    EXPECT_EQ(reader.counts().counter_resets, 0U);
    EXPECT_EQ(reader.counts().missed_scans, 0U);
}

TEST(LidarReader, AScannerThatChangesItsSizeRuleLosesNoScan) {
    LidarReader reader(LidarConfig{});
    std::size_t scans = 0;
    for (std::uint32_t i = 0; i < 20; ++i) {
        S300Telegram telegram = telegram_of(2 * i, level_words(541));
        telegram.size_rule = i < 10 ? S300SizeRule::kFromByte12 : S300SizeRule::kFromByte8;
        for (const Scan& scan : scans_of(reader, encode(telegram), kEpoch + 0.08 * i)) {
            ASSERT_NEAR(scan.stamp, kEpoch + 0.08 * static_cast<double>(scans) - 0.06216, 1e-5);
            ++scans;
        }
    }
    EXPECT_EQ(scans, 20U);
    EXPECT_EQ(reader.counts().counter_resets, 0U);
}

Bytes thesis_scan(std::uint16_t word) {
    Bytes bytes = hex("00 00 00 00 BB BB 11 11");
    for (int i = 0; i < 541; ++i) {
        append(bytes,
               {static_cast<std::uint8_t>(word & 0xFFU), static_cast<std::uint8_t>(word >> 8U)});
    }
    return bytes;
}

TEST(LidarReader, ReadsTheThesisWordsBehindTheirKey) {
    LidarConfig config;
    config.protocol = LidarProtocol::kThesisWords;
    const Bytes good = thesis_scan(300);
    const Bytes cut(good.begin(), good.begin() + 700);
    const Bytes stream = joined({{9, 0, 0}, good, cut, thesis_scan(400), {7, 7}});
    for (const std::size_t piece : {std::size_t{1}, std::size_t{13}, stream.size()}) {
        LidarReader reader(config);
        std::vector<Scan> scans;
        for (std::size_t at = 0; at < stream.size(); at += piece) {
            const std::size_t end = std::min(at + piece, stream.size());
            for (Scan& scan :
                 scans_of(reader, Bytes(stream.begin() + static_cast<std::ptrdiff_t>(at),
                                        stream.begin() + static_cast<std::ptrdiff_t>(end)))) {
                scans.push_back(std::move(scan));
            }
        }
        ASSERT_EQ(scans.size(), 2U);
        EXPECT_THAT(scans[0].ranges, ::testing::Each(FloatEq(3.0F)));
        EXPECT_THAT(scans[1].ranges, ::testing::Each(FloatEq(4.0F)));
        EXPECT_EQ(scans[0].ranges.size(), 541U);
        EXPECT_NEAR(scans[0].angle_min, radians(-135.0), 1e-12);
        EXPECT_NEAR(scans[0].stamp, kEpoch - config.wire_time(1090) - config.latency, 1e-6);
        EXPECT_EQ(reader.counts().stream.garbage_bytes, 3U + 700U);
        EXPECT_EQ(reader.counts().stream.bad_contents, 1U);
        EXPECT_EQ(reader.counts().missed_scans, 0U);
    }
    LidarReader strict(LidarConfig{});
    EXPECT_TRUE(scans_of(strict, stream).empty());
}

Bytes read_file(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(LidarReader, ReadsTheGivenFiles) {
    HYBRID_SLAM_SHARED_OR_SKIP(folder, "data/s300_telegrams");
    const auto read = [&](const char* name) {
        const Bytes bytes = read_file(folder / name);
        LidarReader reader(LidarConfig{});
        const std::vector<Scan> scans = scans_of(reader, bytes);
        EXPECT_EQ(reader.counts().scans, scans.size());
        if (scans.size() == 1) {  // 20 us for each byte and 40 ms of latency
            EXPECT_NEAR(scans[0].stamp, kEpoch - 2e-5 * static_cast<double>(bytes.size()) - 0.04,
                        1e-6);
        }
        return std::make_pair(scans.size(), reader.counts());
    };
    for (const char* name : {"full541_v0102.bin", "full541_v0103.bin", "io_full541_v0102.bin",
                             "io_full541_v0103.bin", "slave08_full541_v0103.bin"}) {
        const auto [scans, counts] = read(name);
        EXPECT_EQ(scans, 1U) << name;
        EXPECT_EQ(counts.beams, 541U) << name;
        // 2996, and 0 to 540 times 3 cm beyond 1 m is all below 29.5 m.
        EXPECT_EQ(counts.no_returns, 1U) << name;
        EXPECT_EQ(counts.protective_scans, 1U) << name;
        EXPECT_EQ(counts.warning_scans,
                  std::string(name).find("v0102") == std::string::npos ? 0U : 1U);
    }
    EXPECT_EQ(read("standby_full541_v0103.bin").first, 0U);
    EXPECT_EQ(read("standby_full541_v0103.bin").second.standby_scans, 1U);
    EXPECT_EQ(read("short5_v0102.bin").second.beams, 5U);
}

/// Scans 100 and 104 are 4 turns of the mirror of 40 ms apart, with a damaged telegram between.
TEST(LidarReader, StampsTheGivenStreamByItsScanNumbers) {
    HYBRID_SLAM_SHARED_OR_SKIP(file, "data/s300_telegrams/stream_garbage_good_corrupt_good.bin");
    const Bytes bytes = read_file(file);
    const auto last = static_cast<std::ptrdiff_t>(bytes.size()) - 1108;  // the second good one
    LidarReader reader(LidarConfig{});
    std::vector<Scan> scans = scans_of(reader, Bytes(bytes.begin(), bytes.begin() + last));
    ASSERT_EQ(scans.size(), 1U);
    EXPECT_NEAR(scans[0].stamp, kEpoch - 0.02216 - 0.04, 1e-5);
    scans = scans_of(reader, Bytes(bytes.begin() + last, bytes.end()), kEpoch + 0.16);
    ASSERT_EQ(scans.size(), 1U);
    EXPECT_NEAR(scans[0].stamp, kEpoch + 0.16 - 0.02216 - 0.04, 1e-5);
    EXPECT_EQ(reader.counts().stream.bad_checksums, 1U);
    EXPECT_EQ(reader.counts().clock_resets, 0U);
}

}  // namespace
}  // namespace hybrid_slam
