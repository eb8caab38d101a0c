// SPDX-License-Identifier: Apache-2.0
#include "recorded_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "forklift_drive.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

VehicleState state_of(double speed, double steering) {
    VehicleState state;
    state.world_from_robot = Pose2d(1.0, -2.0, 0.7);
    state.speed = speed;
    state.steering = steering;
    return state;
}

TEST(RecordedMotion, IsExactForAConstantCommand) {
    const VehicleConfig vehicle;
    for (const double speed : {-0.3, 0.0, 1.2}) {
        for (const double steering : {-1.0, 0.0, 0.4}) {
            const VehicleState start = state_of(speed, steering);
            RecordedMotion motion(vehicle);
            for (int i = 0; i <= 10; ++i) {
                motion.record(5.0 + 0.1 * i, step(vehicle, start, {speed, steering}, 0.1 * i));
            }
            for (double time = 0.0; time <= 1.0; time += 0.013) {
                const VehicleState truth = step(vehicle, start, {speed, steering}, time);
                EXPECT_THAT(motion.world_from_robot(5.0 + time),
                            PoseNear(truth.world_from_robot, 1e-9, 1e-9));
                EXPECT_TRUE(motion.twist(5.0 + time).isApprox(truth.twist(vehicle), 1e-9));
            }
        }
    }
}

TEST(RecordedMotion, FollowsARealDriveToAHundredthOfAMillimetre) {
    const VehicleConfig vehicle;
    VehicleState state = state_of(0.0, 0.0);
    const DriveCommand command{1.0, 0.8};
    RecordedMotion motion(vehicle);
    std::vector<VehicleState> truth;
    for (int i = 0; i <= 1500; ++i) {
        if (i % 5 == 0) {
            motion.record(0.001 * i, state);
        }
        truth.push_back(state);
        state = step(vehicle, state, command, 0.001);
    }
    for (std::size_t i = 0; i < truth.size(); ++i) {
        const double time = 0.001 * static_cast<double>(i);
        EXPECT_THAT(motion.world_from_robot(time), PoseNear(truth[i].world_from_robot, 1e-5, 1e-5));
        EXPECT_TRUE(motion.twist(time).isApprox(truth[i].twist(vehicle), 0.01) ||
                    motion.twist(time).norm() < 0.02);
    }
}

TEST(RecordedMotion, IsClampedAndForgets) {
    const VehicleConfig vehicle;
    RecordedMotion motion(vehicle);
    motion.record(0.0, state_of(0.0, 0.0));
    EXPECT_THAT(motion.world_from_robot(-1.0), PoseNear(Pose2d(1.0, -2.0, 0.7), 0.0, 0.0));
    EXPECT_THAT(motion.world_from_robot(9.0), PoseNear(Pose2d(1.0, -2.0, 0.7), 0.0, 0.0));
    EXPECT_EQ(motion.twist(3.0).norm(), 0.0);
    for (int i = 1; i <= 1000; ++i) {
        VehicleState state = state_of(0.0, 0.0);
        state.world_from_robot = Pose2d(0.01 * i, 0.0, 0.0);
        motion.record(0.01 * i, state);
    }
    EXPECT_EQ(motion.newest(), 10.0);
    EXPECT_NEAR(motion.world_from_robot(99.0).x(), 10.0, 1e-12);
    EXPECT_NEAR(motion.world_from_robot(9.123).x(), 9.123, 1e-9);
    const double oldest = 10.0 - RecordedMotion::kKept;
    EXPECT_NEAR(motion.world_from_robot(oldest).x(), oldest, 1e-9) << "is kept";
    EXPECT_NEAR(motion.world_from_robot(0.5).x(), oldest, 0.02) << "is not";
}

/// What depends on a Motion must see the same drive in either.
TEST(RecordedMotion, OfADriveIsThatDrive) {
    const VehicleConfig vehicle;
    const ForkliftDrive drive({{0, 0}, {1.5, 0}, {1.5, 1.0}}, vehicle, {});
    const Motion& motion = drive;
    const double time = 0.5 * drive.duration();
    EXPECT_THAT(motion.world_from_robot(time), PoseNear(drive.world_from_robot(time), 0.0, 0.0));
    EXPECT_EQ(motion.twist(time), drive.twist(time));
}

}  // namespace
}  // namespace hybrid_slam::test
