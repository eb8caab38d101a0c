// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vehicle/forklift.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

VehicleConfig quick_vehicle() {
    VehicleConfig config;
    config.acceleration = 20.0;
    config.steering_rate = radians(1000.0);
    return config;
}

VehicleState driving(double speed, double steering) {
    VehicleState state;
    state.speed = speed;
    state.steering = steering;
    return state;
}

TEST(Forklift, DrivesTheCircleOfItsSteeringAngle) {
    const VehicleConfig config = quick_vehicle();
    const double steering = radians(30.0);
    const double radius = config.wheelbase / std::tan(steering);
    VehicleState state = driving(0.5, steering);
    const double lap = 2.0 * kPi * radius / 0.5;
    const double quarter = lap / 4.0;
    state = step(config, state, {0.5, steering}, quarter);
    EXPECT_THAT(state.world_from_robot, PoseNear(Pose2d(radius, radius, kPi / 2.0), 1e-9, 1e-9));
    for (int i = 0; i < 3; ++i) {
        state = step(config, state, {0.5, steering}, quarter);
    }
    EXPECT_THAT(state.world_from_robot, PoseNear(Pose2d(), 1e-9, 1e-9));
}

TEST(Forklift, ConstantMotionDoesNotDependOnTheStep) {
    const VehicleConfig config = quick_vehicle();
    const DriveCommand command{-0.4, radians(-20.0)};
    VehicleState coarse = driving(-0.4, radians(-20.0));
    VehicleState fine = coarse;
    coarse = step(config, coarse, command, 3.0);
    for (int i = 0; i < 300; ++i) {
        fine = step(config, fine, command, 0.01);
    }
    EXPECT_THAT(fine.world_from_robot, PoseNear(coarse.world_from_robot, 1e-9, 1e-9));
}

TEST(Forklift, AWheelBehindTurnsTheOtherWay) {
    VehicleConfig ahead = quick_vehicle();
    VehicleConfig behind = quick_vehicle();
    behind.wheelbase = -ahead.wheelbase;
    const VehicleState state = driving(0.3, radians(20.0));
    EXPECT_GT(state.twist(ahead).z(), 0.0);
    EXPECT_DOUBLE_EQ(state.twist(behind).z(), -state.twist(ahead).z());
}

TEST(Forklift, CommandsAreReachedNoFasterThanAllowed) {
    VehicleConfig config;
    config.acceleration = 0.5;
    config.steering_rate = radians(60.0);
    VehicleState state;
    state = step(config, state, {1.0, radians(45.0)}, 0.5);
    EXPECT_DOUBLE_EQ(state.speed, 0.25);
    EXPECT_DOUBLE_EQ(state.steering, radians(30.0));
    state = step(config, state, {1.0, radians(45.0)}, 10.0);
    EXPECT_DOUBLE_EQ(state.speed, 1.0);
    EXPECT_DOUBLE_EQ(state.steering, radians(45.0));
    state = step(config, state, {0.0, 0.0}, 1.0);
    EXPECT_DOUBLE_EQ(state.speed, 0.5) << "braking has the same limit";
}

TEST(Forklift, LimitsHoldWhateverIsAsked) {
    const VehicleConfig config = quick_vehicle();
    const VehicleState state = step(config, {}, {100.0, -3.0}, 100.0);
    EXPECT_DOUBLE_EQ(state.speed, config.speed_limit);
    EXPECT_DOUBLE_EQ(state.steering, -config.steering_limit);
}

TEST(Forklift, SteeringForACurvatureGivesThatCurvature) {
    for (const double wheelbase : {1.2, -1.6}) {
        VehicleConfig config;
        config.wheelbase = wheelbase;
        for (const double curvature : {-0.8, -0.1, 0.0, 0.3, 1.1}) {
            const VehicleState state = driving(0.7, steering_for(config, curvature));
            EXPECT_NEAR(state.twist(config).z() / 0.7, curvature, 1e-12);
        }
        EXPECT_DOUBLE_EQ(std::abs(steering_for(config, 1e6)), config.steering_limit);
    }
}

}  // namespace
}  // namespace hybrid_slam::test
