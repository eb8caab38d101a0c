// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "frames.hpp"
#include "hybrid_slam/can/drive_codec.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using test::frame;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kRpmPerSpeed = 21.96 * 60.0 / (2.0 * kPi * 0.15);  // the facts: 1398 at 1 m/s

VehicleConfig quick_truck() {
    VehicleConfig vehicle;
    vehicle.speed_limit = 3.0;
    return vehicle;
}

CanFrame encoded(const DriveLayout& layout, const DriveCommand& command, bool enabled = true) {
    const auto frames = make_drive_codec(layout, quick_truck())->encode(command, enabled);
    EXPECT_EQ(frames.size(), 1U);
    return frames.at(0);
}

DriveLayout of_axle() {
    DriveLayout layout;
    layout.speed_of = SpeedOf::kAxle;
    return layout;
}

TEST(CurtisCodec, TheExamplesByteForByte) {
    const double speed = 500.0 / kRpmPerSpeed;
    const double steering = radians(-10.0);
    EXPECT_EQ(encoded(of_axle(), {speed, steering}), frame("203#03F4010A0A18FC00"));
    EXPECT_EQ(encoded({}, {speed * std::cos(steering), steering}), frame("203#03F4010A0A18FC00"));
    EXPECT_EQ(encoded({}, {0.0, 0.0}), frame("203#0100000A0A000000"));
    EXPECT_EQ(encoded({}, {speed, steering}, false), frame("203#0000000000000000"));
    EXPECT_EQ(encoded(of_axle(), {1.0, 0.0}), frame("203#0376050A0A000000")) << "1398 rpm";
}

TEST(CurtisCodec, EverySignAndIdIsData) {
    const double speed = 500.0 / kRpmPerSpeed;
    const double left = radians(10.0);
    EXPECT_EQ(encoded(of_axle(), {-speed, left}), frame("203#05F4010A0AE80300"));
    DriveLayout layout = of_axle();
    layout.drive_inverted = true;
    layout.steering_inverted = true;
    layout.node = 0x26;
    layout.acceleration_time = 0.2;
    layout.deceleration_time = 25.5;
    EXPECT_EQ(encoded(layout, {-speed, left}), frame("226#03F40102FF18FC00"));
}

TEST(CurtisCodec, LimitsHold) {
    DriveLayout layout;
    layout.rpm_limit = 1000.0;
    EXPECT_EQ(encoded(layout, {2.0, 0.0}), frame("203#03E8030A0A000000"));
    EXPECT_EQ(encoded(layout, {-2.0, 0.0}), frame("203#05E8030A0A000000"));
    EXPECT_EQ(encoded({}, {100.0, 0.0}), encoded({}, {3.0, 0.0})) << "the vehicle's";
    EXPECT_EQ(encoded({}, {0.0, 3.0}), frame("203#0100000A0A4C1D00")) << "75 degrees";
    EXPECT_EQ(encoded({}, {1e-5, 0.0}), frame("203#0100000A0A000000")) << "no flag without rpm";
    for (const DriveCommand& bad : {DriveCommand{NAN, 0.0}, DriveCommand{0.0, HUGE_VAL}}) {
        EXPECT_THAT(error_of([&] { encoded({}, bad); }), HasSubstr("finite"));
        EXPECT_THAT(error_of([&] { encoded({}, bad, false); }), HasSubstr("finite"));
    }
}

TEST(CurtisCodec, AWheelThatIsNotYetTurnedGetsNoSpeedForIt) {
    const auto codec = make_drive_codec({}, quick_truck());
    const DriveCommand command{0.3, radians(60.0)};
    const auto rpm = [&] { return codec->encode(command, true).at(0).data[1]; };
    const auto turned = static_cast<std::uint8_t>(std::lround(0.6 * kRpmPerSpeed) & 0xFF);
    const auto straight = static_cast<std::uint8_t>(std::lround(0.3 * kRpmPerSpeed) & 0xFF);
    EXPECT_EQ(rpm(), turned) << "a truck that never tells its angle";
    codec->decode(frame("383#0000"));
    EXPECT_EQ(rpm(), straight);
    codec->decode(frame("383#701700"));  // 60 degrees
    EXPECT_EQ(rpm(), turned);
    codec->decode(frame("383#581B00"));  // 70
    EXPECT_EQ(rpm(), turned);
}

TEST(CurtisCodec, StartsTheNodeWhereAsked) {
    EXPECT_THAT(make_drive_codec({}, {})->start(), ElementsAre(frame("000#0103")));
    DriveLayout layout;
    layout.start_nodes = false;
    EXPECT_THAT(make_drive_codec(layout, {})->start(), IsEmpty());
}

TEST(CurtisCodec, FeedbackIsPutTogether) {
    const auto codec = make_drive_codec({}, {});
    auto feedback = codec->decode(frame("183#F40132000050FA00"));
    ASSERT_TRUE(feedback);
    EXPECT_EQ(feedback->speed, std::nullopt) << "the wheel's angle is not known yet";
    EXPECT_EQ(feedback->battery, 0.8);
    EXPECT_FALSE(feedback->faulty());
    feedback = codec->decode(frame("383#7017000000000000"));  // 60 degrees
    ASSERT_TRUE(feedback && feedback->speed && feedback->steering);
    EXPECT_NEAR(*feedback->steering, radians(60.0), 1e-12);
    EXPECT_NEAR(*feedback->speed, 0.5 * 500.0 / kRpmPerSpeed, 1e-12);
    EXPECT_EQ(feedback->battery, 0.8) << "remembered";

    const auto axle = make_drive_codec(of_axle(), {});
    EXPECT_NEAR(*axle->decode(frame("183#0CFE32000050FA00"))->speed, -500.0 / kRpmPerSpeed, 1e-12);
}

TEST(CurtisCodec, FaultsAreToldByTheirCodes) {
    const auto codec = make_drive_codec({}, {});
    EXPECT_EQ(codec->decode(frame("183#000000001750FA00"))->drive_fault, 0x17);
    EXPECT_EQ(codec->decode(frame("383#0000220000000000"))->steering_fault, 0x22);
    EXPECT_TRUE(codec->decode(frame("383#0000000000000000"))->faulty()) << "the drive's stays";
    EXPECT_FALSE(codec->decode(frame("183#000000000050FA00"))->faulty());
    DriveLayout layout;
    layout.steering_fault_byte = 3;
    EXPECT_EQ(make_drive_codec(layout, {})->decode(frame("383#00002233"))->steering_fault, 0x33);
    EXPECT_EQ(make_drive_codec(layout, {})->decode(frame("383#000022"))->steering_fault, 0);
    layout.steering_fault_byte = 0;
    EXPECT_EQ(make_drive_codec(layout, {})->decode(frame("383#FFFF2233"))->steering_fault, 0);
}

TEST(CurtisCodec, OtherFramesAreNotForIt) {
    const auto codec = make_drive_codec({}, {});
    for (const char* other : {"184#F40132000050FA00", "283#0000000000000000", "183#F401", "183#R8",
                              "00000183#F40132000050FA00", "383#10", "203#00"}) {
        EXPECT_EQ(codec->decode(frame(other)), std::nullopt) << other;
    }
}

}  // namespace
}  // namespace hybrid_slam
