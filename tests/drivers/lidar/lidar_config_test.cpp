// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/lidar/lidar_config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "hybrid_slam/lidar/lidar_reader.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using test::TempFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(LidarConfigKeys, AreReadAndWritten) {
    const TempFolder folder;
    LidarConfig config;
    ConfigSchema schema;
    describe(schema, config);
    schema.load(
        folder.write("lidar.yaml",
                     "protocol: thesis_words\nport: tcp://10.0.0.5:4001\nbaud: 115200\naddress: "
                     "8\nx: 1.2\ny: -0.1\n"
                     "yaw_deg: 90\nupside_down: true\nangle_step_deg: 0.25\nangle_offset_deg: -5\n"
                     "blind_sectors_deg: [-135, -120, 120, 135]\nrange_min: 0.1\nrange_max: 20\n"
                     "count_period: 0.05\nturn_time: 0.06\nlatency: 0.01\n"));
    EXPECT_EQ(config.protocol, LidarProtocol::kThesisWords);
    EXPECT_EQ(config.port, "tcp://10.0.0.5:4001");
    EXPECT_EQ(config.baud, 115200);
    EXPECT_EQ(config.address, 8);
    EXPECT_EQ(config.robot_from_laser().translation.x(), 1.2);
    EXPECT_EQ(config.robot_from_laser().heading, radians(90.0));
    EXPECT_TRUE(config.upside_down);
    EXPECT_EQ(config.angle_step, radians(0.25));
    EXPECT_EQ(config.angle_offset, radians(-5.0));
    EXPECT_THAT(config.blind_sectors_deg, ElementsAre(-135.0, -120.0, 120.0, 135.0));
    EXPECT_EQ(config.count_period, 0.05);
    EXPECT_EQ(config.turn_time, 0.06);
    EXPECT_EQ(config.latency, 0.01);

    LidarConfig again;
    ConfigSchema second;
    describe(second, again);
    second.load(folder.write("again.yaml", schema.to_yaml()));
    EXPECT_EQ(second.to_yaml(), schema.to_yaml());
}

TEST(LidarConfigKeys, TimesFollow) {
    LidarConfig config;
    EXPECT_NEAR(config.wire_time(1108), 0.02216, 1e-12);  // as the facts say for 500 kBd
    EXPECT_NEAR(config.time_increment(), 0.040 / 720.0, 1e-15);
}

TEST(LidarConfigKeys, WhatIsOutOfRangeIsRefused) {
    const auto refusal = [](auto change) {
        LidarConfig config;
        change(config);
        return error_of([&] { const LidarReader reader(config); });
    };
    EXPECT_THAT(refusal([](LidarConfig& c) {
                    c.blind_sectors_deg = {1.0, 2.0, 3.0};
                }),
                HasSubstr("lidar.blind_sectors_deg: must hold pairs"));
    EXPECT_THAT(refusal([](LidarConfig& c) { c.range_min = c.range_max; }),
                HasSubstr("lidar.range_min: must be less than lidar.range_max"));
    for (const char* assignment : {"baud=0", "angle_step_deg=0", "range_max=0", "range_max=82",
                                   "address=256", "address=-1", "count_period=0", "turn_time=-1",
                                   "latency=2", "blind_sectors_deg=[400, 1]", "protocol=s3000"}) {
        LidarConfig config;
        ConfigSchema schema;
        describe(schema, config);
        const std::string key(assignment, std::string(assignment).find('='));
        EXPECT_THAT(error_of([&] { schema.override_with(assignment); }), HasSubstr(key));
    }
}

}  // namespace
}  // namespace hybrid_slam
