// SPDX-License-Identifier: Apache-2.0
#include "cia402.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "can_open.hpp"
#include "frames.hpp"
#include "hybrid_slam/can/drive_codec.hpp"
#include "hybrid_slam/can/truck_can.hpp"
#include "little_endian.hpp"

namespace hybrid_slam {
namespace {

using cia402::PowerState;
using test::frame;
using ::testing::ElementsAre;

DriveLayout two_nodes() {
    DriveLayout layout;
    layout.profile = DriveProfile::kCia402;
    layout.speed_of = SpeedOf::kAxle;
    return layout;
}

CanFrame status(int node, unsigned word, std::int32_t actual) {
    CanFrame frame = CanFrame::of(can_open::id(can_open::kTpdo1, node), {0, 0, 0, 0, 0, 0});
    put(frame, 0, word, 2);
    put(frame, 2, actual, 4);
    return frame;
}

unsigned controlword(DriveCodec& codec, bool enabled) {
    return unsigned_at(codec.encode({0.3, 0.1}, enabled).at(0), 0, 2);
}

TEST(Cia402, StatusWordsAsTheStandardListsThem) {
    const std::pair<unsigned, PowerState> words[] = {{0x00, PowerState::kNotReady},
                                                     {0x20, PowerState::kNotReady},
                                                     {0x40, PowerState::kSwitchOnDisabled},
                                                     {0x60, PowerState::kSwitchOnDisabled},
                                                     {0x21, PowerState::kReady},
                                                     {0x23, PowerState::kSwitchedOn},
                                                     {0x27, PowerState::kEnabled},
                                                     {0x07, PowerState::kQuickStop},
                                                     {0x0F, PowerState::kFaultReaction},
                                                     {0x2F, PowerState::kFaultReaction},
                                                     {0x08, PowerState::kFault},
                                                     {0x28, PowerState::kFault}};
    for (const auto& [word, state] : words) {
        for (const unsigned others : {0x0000U, 0xFF90U, 0x0610U}) {
            EXPECT_EQ(cia402::power_state(word | others), state) << std::hex << word << others;
        }
    }
}

TEST(Cia402, StartsAndSetsTheModes) {
    EXPECT_THAT(make_drive_codec(two_nodes(), {})->start(),
                ElementsAre(frame("000#0103"), frame("603#2F60600003000000"), frame("000#0104"),
                            frame("604#2F60600008000000")));
}

TEST(Cia402, EveryStateLeadsTowardsPower) {
    const std::pair<unsigned, unsigned> steps[] = {{0x40, 0x06}, {0x21, 0x07}, {0x23, 0x0F},
                                                   {0x27, 0x0F}, {0x07, 0x00}, {0x0F, 0x00},
                                                   {0x00, 0x06}, {0x08, 0x80}};
    for (const auto& [word, answer] : steps) {
        const auto codec = make_drive_codec(two_nodes(), {});
        EXPECT_EQ(controlword(*codec, true), 0x06U) << "nothing is known yet";
        codec->decode(status(3, word, 0));
        EXPECT_EQ(controlword(*codec, true), answer) << std::hex << word;
        EXPECT_EQ(controlword(*codec, false), 0x06U) << std::hex << word;
    }
}

TEST(Cia402, MotionOnlyWhenBothNodesHavePower) {
    const auto codec = make_drive_codec(two_nodes(), {});
    const auto velocity = [&] { return i32_at(codec->encode({0.5, 0.1}, true).at(0), 2); };
    const auto position = [&] { return i32_at(codec->encode({0.5, 0.1}, true).at(1), 2); };
    codec->decode(status(3, 0x27, 0));
    EXPECT_EQ(velocity(), 0);
    codec->decode(status(4, 0x23, 1234));
    EXPECT_EQ(velocity(), 0);
    EXPECT_EQ(position(), 1234) << "stays where it is";
    codec->decode(status(4, 0x27, 1234));
    EXPECT_EQ(velocity(), 699);  // 0.5 m/s of 1398 rpm
    EXPECT_EQ(position(), 573);  // 0.1 rad in 0.01 deg
    EXPECT_EQ(i32_at(codec->encode({0.5, 0.1}, false).at(0), 2), 0);
    codec->decode(status(3, 0x08, 0));
    EXPECT_EQ(velocity(), 0);
}

TEST(Cia402, AFaultIsResetOnceWhenPowerIsAskedForAnew) {
    const auto codec = make_drive_codec(two_nodes(), {});
    codec->decode(status(3, 0x08, 0));
    EXPECT_EQ(controlword(*codec, true), 0x80U);
    codec->decode(status(3, 0x27, 0));
    EXPECT_EQ(controlword(*codec, true), 0x0FU);
    codec->decode(status(3, 0x08, 0));
    EXPECT_EQ(controlword(*codec, true), 0x00U) << "one that comes on the way stays";
    EXPECT_EQ(controlword(*codec, false), 0x06U);
    EXPECT_EQ(controlword(*codec, true), 0x80U);
}

TEST(Cia402, FeedbackInOurUnits) {
    DriveLayout layout = two_nodes();
    layout.velocity_per_rpm = 10.0;
    layout.position_per_degree = 250.0;
    layout.steering_inverted = true;
    const auto codec = make_drive_codec(layout, {});
    codec->decode(status(3, 0x27, -13980));
    const auto feedback = codec->decode(status(4, 0x27, -2500));
    ASSERT_TRUE(feedback && feedback->speed && feedback->steering);
    EXPECT_NEAR(*feedback->speed, -1.0, 1e-4);
    EXPECT_NEAR(*feedback->steering, radians(10.0), 1e-12);
    EXPECT_TRUE(feedback->ready);
    EXPECT_FALSE(feedback->faulty());
    EXPECT_EQ(codec->decode(status(4, 0x08, 0))->steering_fault, -1) << "no code told";
    EXPECT_EQ(codec->decode(frame("084#1023000000000000"))->steering_fault, 0x2310);
    EXPECT_EQ(codec->decode(status(4, 0x40, 0))->steering_fault, 0);
    EXPECT_EQ(codec->decode(frame("205#000000000000")), std::nullopt);
}

/// Codec and truck on one bus without delay, 50 times a second.
class Cia402Loop : public ::testing::Test {
  protected:
    Cia402Loop() : codec_(make_drive_codec(two_nodes(), {})), truck_(two_nodes(), {}, {}, 0.0) {
        hear(codec_->start());
    }
    void hear(const std::vector<CanFrame>& frames) {
        for (const CanFrame& frame : frames) {
            listen(truck_.receive(frame, now_));
        }
    }
    void listen(const std::vector<CanFrame>& frames) {
        for (const CanFrame& frame : frames) {
            if (const auto feedback = codec_->decode(frame)) {
                feedback_ = *feedback;
            }
        }
    }
    void run(const DriveCommand& command, bool enabled, double seconds) {
        for (const double end = now_ + seconds; now_ < end;) {
            hear(codec_->encode(command, enabled));
            now_ += 0.02;
            listen(truck_.advance(now_));
        }
    }

    std::unique_ptr<DriveCodec> codec_;
    TruckCan truck_;
    DriveFeedback feedback_;
    double now_ = 0.0;
};

TEST_F(Cia402Loop, ComesToPowerDrivesAndLetsGo) {
    run({0.3, 0.2}, false, 0.5);
    EXPECT_FALSE(truck_.driven());
    run({0.3, 0.2}, true, 3.0);
    EXPECT_TRUE(truck_.driven());
    EXPECT_TRUE(feedback_.ready);
    EXPECT_NEAR(truck_.state().speed, 0.3, 1e-3);
    EXPECT_NEAR(truck_.state().steering, 0.2, 1e-4);
    EXPECT_NEAR(feedback_.speed.value(), 0.3, 1e-3);
    EXPECT_NEAR(feedback_.steering.value(), 0.2, 1e-4);
    run({0.3, 0.2}, false, 2.0);
    EXPECT_FALSE(truck_.driven());
    EXPECT_EQ(truck_.state().speed, 0.0);
    EXPECT_NEAR(truck_.state().steering, 0.2, 1e-4) << "no power, no steering";
}

TEST_F(Cia402Loop, AFaultStopsAndIsResetByANewStart) {
    run({0.3, 0.0}, true, 2.0);
    truck_.set_fault(0x2310);
    run({0.3, 0.0}, true, 2.0);
    EXPECT_EQ(feedback_.drive_fault, 0x2310);
    EXPECT_EQ(truck_.state().speed, 0.0);
    run({0.0, 0.0}, false, 0.1);
    run({0.3, 0.0}, true, 2.0);
    EXPECT_FALSE(feedback_.faulty());
    EXPECT_NEAR(truck_.state().speed, 0.3, 1e-3);
}

TEST_F(Cia402Loop, UnknownObjectsAreRefusedAndStoppedNodesSilent) {
    const auto answers = truck_.receive(frame("603#4041600000000000"), now_);
    EXPECT_THAT(answers, ElementsAre(frame("583#8041600000000206")));
    truck_.receive(frame("000#0200"), now_);
    EXPECT_TRUE(truck_.advance(now_ + 1.0).empty());
}

}  // namespace
}  // namespace hybrid_slam
