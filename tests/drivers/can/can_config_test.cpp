// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "hybrid_slam/can/can_drive.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using test::TempFolder;
using ::testing::HasSubstr;

void describe_as_section(ConfigSchema& schema, CanDriveConfig& config) {
    const ConfigSchema::Section section(schema, "can");
    describe(schema, config);
}

TEST(CanDriveConfig, ReadsEveryKey) {
    const TempFolder folder;
    CanDriveConfig config;
    ConfigSchema schema;
    describe_as_section(schema, config);
    schema.load(
        folder.write("truck.yaml",
                     "can:\n  port: slcan:/dev/ttyACM1\n  bit_rate: 500000\n  baud: 921600\n"
                     "  slcan_silent: true\n  profile: cia402\n  node: 5\n"
                     "  steering_node: 6\n  start_nodes: false\n  speed_of: axle\n"
                     "  gear: 30.5\n  wheel_radius: 0.11\n  drive_inverted: true\n"
                     "  steering_inverted: true\n  rpm_limit: 3000\n"
                     "  acceleration_time: 2.5\n  deceleration_time: 0.5\n"
                     "  steering_fault_byte: 3\n  velocity_per_rpm: 10\n"
                     "  position_per_degree: 250\n  rate: 100\n  command_valid: 0.1\n"
                     "  release_after: 3\n  feedback_valid: 0.25\n"));
    EXPECT_EQ(config.bus.port, "slcan:/dev/ttyACM1");
    EXPECT_EQ(config.bus.bit_rate, 500000);
    EXPECT_EQ(config.bus.baud, 921600);
    EXPECT_TRUE(config.bus.slcan_silent);
    EXPECT_EQ(config.layout.profile, DriveProfile::kCia402);
    EXPECT_EQ(config.layout.node, 5);
    EXPECT_EQ(config.layout.steering_node, 6);
    EXPECT_FALSE(config.layout.start_nodes);
    EXPECT_EQ(config.layout.speed_of, SpeedOf::kAxle);
    EXPECT_EQ(config.layout.gear, 30.5);
    EXPECT_EQ(config.layout.wheel_radius, 0.11);
    EXPECT_TRUE(config.layout.drive_inverted);
    EXPECT_TRUE(config.layout.steering_inverted);
    EXPECT_EQ(config.layout.rpm_limit, 3000.0);
    EXPECT_EQ(config.layout.acceleration_time, 2.5);
    EXPECT_EQ(config.layout.deceleration_time, 0.5);
    EXPECT_EQ(config.layout.steering_fault_byte, 3);
    EXPECT_EQ(config.layout.velocity_per_rpm, 10.0);
    EXPECT_EQ(config.layout.position_per_degree, 250.0);
    EXPECT_EQ(config.rate, 100.0);
    EXPECT_EQ(config.command_valid, 0.1);
    EXPECT_EQ(config.release_after, 3.0);
    EXPECT_EQ(config.feedback_valid, 0.25);
    EXPECT_EQ(schema.fields().size(), 23U) << "a key that this test does not know";

    CanDriveConfig again;
    ConfigSchema second;
    describe_as_section(second, again);
    second.load(folder.write("again.yaml", schema.to_yaml()));
    EXPECT_EQ(second.to_yaml(), schema.to_yaml());
}

TEST(CanDriveConfig, WhatIsOutOfRangeIsRefused) {
    for (const char* assignment :
         {"can.node=0", "can.node=128", "can.profile=curtiss", "can.speed_of=motor", "can.gear=0",
          "can.wheel_radius=0", "can.rpm_limit=70000", "can.acceleration_time=26",
          "can.steering_fault_byte=8", "can.rate=0", "can.command_valid=0", "can.bit_rate=9",
          "can.position_per_degree=0", "can.feedback_valid=0", "can.release_after=-1"}) {
        CanDriveConfig config;
        ConfigSchema schema;
        describe_as_section(schema, config);
        const std::string key(assignment, std::string(assignment).find('='));
        EXPECT_THAT(error_of([&] { schema.override_with(assignment); }), HasSubstr(key));
    }
}

TEST(CanDriveConfig, TwoNodesMustBeTwo) {
    DriveLayout layout;
    layout.steering_node = layout.node;
    EXPECT_NO_THROW(make_drive_codec(layout, {})) << "curtis has one node only";
    layout.profile = DriveProfile::kCia402;
    EXPECT_THAT(error_of([&] { make_drive_codec(layout, {}); }), HasSubstr("can.steering_node"));
}

}  // namespace
}  // namespace hybrid_slam
