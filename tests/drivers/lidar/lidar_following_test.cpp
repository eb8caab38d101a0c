// SPDX-License-Identifier: Apache-2.0
// Which telegrams a reader follows, and what it makes of steps of their counter.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scans.hpp"

namespace hybrid_slam {
namespace {

using namespace test;  // NOLINT

TEST(LidarFollowing, OnlyTheFirstDeviceAndFieldAreFollowed) {
    LidarReader reader(LidarConfig{});
    S300Telegram guest = telegram_of(700);
    guest.address = 8;
    S300Telegram second = telegram_of(2);
    second.field = 2;
    S300Telegram io;
    io.scan_number = 2;
    io.io = {5};
    const std::vector<Scan> scans =
        scans_of(reader, joined({encode(io), encode(telegram_of(2)), encode(guest), encode(second),
                                 encode(io), encode(telegram_of(4))}));
    EXPECT_EQ(scans.size(), 2U);
    EXPECT_EQ(reader.counts().other_devices, 1U);
    EXPECT_EQ(reader.counts().other_fields, 1U);
    EXPECT_EQ(reader.counts().without_distances, 2U);
    EXPECT_EQ(reader.counts().counter_resets, 0U);
}

TEST(LidarFollowing, FieldsBehindTheFirstMoveNoBeam) {
    LidarReader reader(LidarConfig{});
    const std::vector<Scan> scans =
        scans_of(reader, encode(telegram_of(2, {100, 200, 300, 0xBBBB, 0x2222, 400, 500})));
    ASSERT_EQ(scans.size(), 1U);
    EXPECT_EQ(scans[0].ranges.size(), 3U);
    EXPECT_NEAR(scans[0].angle_min, radians(-0.5), 1e-12);
    EXPECT_EQ(reader.counts().other_fields, 1U);
}

TEST(LidarFollowing, TheScannerToFollowCanBeChosen) {
    for (const int address : {0, 7, 8, 9}) {
        LidarConfig config;
        config.address = address;
        LidarReader reader(config);
        std::vector<double> firsts;
        for (std::uint32_t i = 0; i < 5; ++i) {
            S300Telegram guest = telegram_of(900 + 2 * i, {800});
            guest.address = 8;
            const Bytes both = joined({encode(guest), encode(telegram_of(2 * i, {700}))});
            for (const Scan& scan : scans_of(reader, both, kEpoch + 0.08 * i)) {
                firsts.push_back(scan.ranges[0]);
            }
        }
        const std::size_t scans = address == 9 ? 0 : 5;
        EXPECT_EQ(firsts.size(), scans);
        EXPECT_THAT(firsts, ::testing::Each(address == 7 ? 7.0 : 8.0));
        EXPECT_EQ(reader.counts().other_devices, 10U - scans);
        EXPECT_EQ(reader.counts().counter_resets, 0U);
    }
}

TEST(LidarFollowing, ScansMissingAreToldByTheUsualStep) {
    LidarReader reader(LidarConfig{});
    double arrival = kEpoch;
    std::size_t scans = 0;
    for (const std::uint32_t number : {10U, 16U, 18U, 20U, 22U, 28U, 30U, 30U, 32U}) {
        arrival += 0.08;
        scans += scans_of(reader, encode(telegram_of(number)), arrival).size();
    }
    EXPECT_EQ(scans, 8U);
    EXPECT_EQ(reader.counts().repeated_scans, 1U);
    // The first step was no gap yet, for nothing was known.
    EXPECT_EQ(reader.counts().missed_scans, 2U);
}

TEST(LidarFollowing, AScannerSwitchedOffAndOnIsNoGap) {
    for (const std::uint32_t restart : {1U, 2000000U}) {
        LidarReader reader(LidarConfig{});
        double arrival = kEpoch;
        for (const std::uint32_t number : {1000U, 1002U, 1004U, restart, restart + 2}) {
            arrival += 0.08;
            ASSERT_EQ(scans_of(reader, encode(telegram_of(number)), arrival).size(), 1U);
        }
        EXPECT_EQ(reader.counts().counter_resets, 1U);
        EXPECT_EQ(reader.counts().clock_resets, 1U);
        EXPECT_EQ(reader.counts().missed_scans, 0U);
    }
}

TEST(LidarFollowing, AHostClockThatIsSetIsNoRestartOfTheScanner) {
    for (const double shift : {-3600.0, -0.2, 0.2, 3600.0}) {
        LidarReader reader(LidarConfig{});
        for (std::uint32_t i = 0; i < 200; ++i) {
            const double arrival = kEpoch + 0.08 * i + (i < 100 ? 0.0 : shift);
            ASSERT_EQ(scans_of(reader, encode(telegram_of(2 * i)), arrival).size(), 1U);
        }
        EXPECT_EQ(reader.counts().clock_resets, 1U) << shift;
        EXPECT_EQ(reader.counts().counter_resets, 0U) << shift;
        EXPECT_EQ(reader.counts().missed_scans, 0U) << shift;
    }
}

TEST(LidarFollowing, AnInterruptionIsNeitherARestartNorANewFit) {
    LidarReader reader(LidarConfig{});
    for (std::uint32_t i = 0; i < 200; ++i) {
        if (i < 50 || i >= 190) {
            scans_of(reader, encode(telegram_of(4 * i)), kEpoch + 0.16 * i);
        }
    }
    EXPECT_EQ(reader.counts().counter_resets, 0U);
    EXPECT_EQ(reader.counts().clock_resets, 0U);
    EXPECT_EQ(reader.counts().missed_scans, 140U);
}

}  // namespace
}  // namespace hybrid_slam
