// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/can/truck_can.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "frames.hpp"
#include "hybrid_slam/can/drive_codec.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam {
namespace {

using test::frame;
using test::PoseNear;

/// The same command again and again, as a host sends it.
void drive(TruckCan& truck, DriveCodec& codec, const DriveCommand& command, double from,
           double until) {
    const long cycles = std::lround((until - from) / 0.02);
    for (long i = 0; i < cycles; ++i) {
        const double now = from + 0.02 * static_cast<double>(i);
        for (const CanFrame& sent : codec.encode(command, true)) {
            for (const CanFrame& told : truck.receive(sent, now)) {
                codec.decode(told);
            }
        }
    }
    truck.advance(until);
}

TEST(TruckCan, DrivesAsTheVehicleDoes) {
    for (const double wheelbase : {1.2, -1.2}) {
        VehicleConfig vehicle;
        vehicle.wheelbase = wheelbase;
        const DriveCommand command{-0.3, radians(40.0)};
        TruckCan truck({}, vehicle, {}, 100.0);
        const auto codec = make_drive_codec({}, vehicle);
        drive(truck, *codec, command, 100.0, 110.0);
        VehicleState expected;
        for (int i = 0; i < 10000; ++i) {
            expected = step(vehicle, expected, command, 0.001);
        }
        // rpm are whole numbers, and the wheel's speed is the axle's only once the wheel has
        // turned.
        EXPECT_NEAR(truck.state().speed, command.speed, 1e-3);
        EXPECT_NEAR(truck.state().steering, command.steering, 1e-4);
        EXPECT_THAT(truck.state().world_from_robot,
                    PoseNear(expected.world_from_robot, 0.05, 0.05));
    }
}

TEST(TruckCan, TheDrivenWheelSlowsTheAxleWhenItIsTurned) {
    const VehicleConfig vehicle;
    VehicleState state;
    state.steering = radians(60.0);
    TruckCan truck({}, vehicle, state, 0.0);
    // 500 rpm with the wheel at 60 degrees.
    for (int i = 0; i <= 100; ++i) {
        truck.receive(frame("203#03F4010A0A701700"), 0.02 * i);
    }
    EXPECT_NEAR(truck.state().speed, 0.5 * 500.0 / 1397.99, 1e-4);
}

TEST(TruckCan, FeedbackIsWhatTheHostUnderstands) {
    TruckCan truck({}, {}, {}, 0.0);
    const auto codec = make_drive_codec({}, {});
    drive(truck, *codec, {0.25, radians(-20.0)}, 0.0, 3.0);
    DriveFeedback feedback;
    for (const CanFrame& told : truck.advance(3.03)) {
        feedback = codec->decode(told).value();
    }
    EXPECT_NEAR(feedback.speed.value(), truck.state().speed, 1e-3);
    EXPECT_NEAR(feedback.steering.value(), truck.state().steering, 1e-4);
    EXPECT_EQ(feedback.battery, 0.8);
}

TEST(TruckCan, TellsItsStateFiftyTimesASecondHoweverItIsAsked) {
    for (const double tick : {0.001, 0.02, 0.0333, 1.0}) {
        TruckCan truck({}, {}, {}, 5.0);
        std::size_t frames = 0;
        for (int i = 1; i * tick <= 10.0; ++i) {
            frames += truck.advance(5.0 + i * tick).size();
        }
        frames += truck.advance(15.01).size();
        EXPECT_EQ(frames, 2U * 500U) << tick;
        EXPECT_TRUE(truck.advance(14.0).empty()) << "never backwards";
    }
}

TEST(TruckCan, StopsByItselfWhenCommandsEnd) {
    TruckCan truck({}, {}, {}, 0.0);
    const auto codec = make_drive_codec({}, {});
    EXPECT_FALSE(truck.driven());
    drive(truck, *codec, {0.3, 0.1}, 0.0, 3.0);
    EXPECT_TRUE(truck.driven());
    truck.advance(2.98 + 0.299);
    EXPECT_TRUE(truck.driven());
    EXPECT_NEAR(truck.state().speed, 0.3, 1e-3);
    truck.advance(2.98 + 0.301);
    EXPECT_FALSE(truck.driven());
    truck.advance(2.98 + 0.301 + 0.7);  // 0.3 m/s at 0.5 m/s^2
    EXPECT_EQ(truck.state().speed, 0.0);
    const VehicleState stopped = truck.state();
    truck.advance(100.0);
    EXPECT_THAT(truck.state().world_from_robot, PoseNear(stopped.world_from_robot, 0.0, 0.0));
    EXPECT_NEAR(truck.state().steering, 0.1, 1e-3) << "the wheel stays";
}

TEST(TruckCan, WithoutInterlockOrWithBothDirectionsItStands) {
    for (const char* none : {"203#02F4010A0A000000", "203#07F4010A0A000000", "203#01F4010A0A000000",
                             "203#03F401", "204#03F4010A0A000000"}) {
        TruckCan truck({}, {}, {}, 0.0);
        for (int i = 0; i < 100; ++i) {
            truck.receive(frame(none), 0.02 * i);
        }
        EXPECT_EQ(truck.state().speed, 0.0) << none;
    }
}

TEST(TruckCan, AFaultTakesThePowerUntilItIsCleared) {
    TruckCan truck({}, {}, {}, 0.0);
    const auto codec = make_drive_codec({}, {});
    drive(truck, *codec, {0.3, 0.0}, 0.0, 2.0);
    truck.set_fault(0x17);
    drive(truck, *codec, {0.3, 0.0}, 2.0, 4.0);
    EXPECT_EQ(truck.state().speed, 0.0);
    EXPECT_EQ(codec->decode(truck.advance(4.03).at(0))->drive_fault, 0x17);
    truck.set_fault(0);
    drive(truck, *codec, {0.3, 0.0}, 4.04, 6.0);
    EXPECT_NEAR(truck.state().speed, 0.3, 1e-3);
}

TEST(TruckCan, NothingOnTheBusMakesItLeaveItsLimits) {
    std::mt19937 rng(5);
    for (const DriveProfile profile : {DriveProfile::kCurtis, DriveProfile::kCia402}) {
        DriveLayout layout;
        layout.profile = profile;
        const VehicleConfig vehicle;
        TruckCan truck(layout, vehicle, {}, 0.0);
        for (int i = 0; i < 5000; ++i) {
            CanFrame noise = test::random_frame(rng);
            const std::uint32_t ids[] = {0x203, 0x204, 0x000, 0x603};
            if (i % 2 == 0) {
                noise.extended = false;
                noise.id = ids[rng() % 4];
            }
            truck.receive(noise, 0.01 * i);
            EXPECT_LE(std::abs(truck.state().speed), vehicle.speed_limit);
            EXPECT_LE(std::abs(truck.state().steering), vehicle.steering_limit);
        }
    }
}

}  // namespace
}  // namespace hybrid_slam
