// SPDX-License-Identifier: Apache-2.0
#include "pose_keeper.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

constexpr double kInterval = 0.08;  // seconds

PoseBelief belief(const Pose2d& pose, double sigma, double angle) {
    return {pose, Eigen::Vector3d(sigma * sigma, sigma * sigma, angle * angle).asDiagonal()};
}

TEST(PoseKeeper, HoldsNothingToJumpFromAtFirst) {
    PoseKeeper keeper;
    keeper.carry(0.0, {0.1, 0.0, 0.0});
    EXPECT_FALSE(keeper.jump_to({100.0, 0.0, 0.0}).has_value());
}

TEST(PoseKeeper, CarriesThePoseByTheMotionInTheAxesOfTheRobot) {
    PoseKeeper keeper;
    keeper.hold(belief({5.0, 3.0, kPi / 2.0}, 0.001, 0.001));
    keeper.carry(0.0, {});
    Pose2d expected(5.0, 3.0, kPi / 2.0);
    for (int i = 1; i <= 50; ++i) {
        const Pose2d motion(0.08, 0.0, 0.02);
        expected = expected * motion;
        keeper.carry(i * kInterval, motion);
    }
    EXPECT_FALSE(keeper.jump_to(expected).has_value());
    const auto jump = keeper.jump_to(expected * Pose2d(0.2, 0.0, 0.0));
    ASSERT_TRUE(jump.has_value());
    EXPECT_THAT(jump->from, PoseNear(expected, 1e-9, 1e-9));
    EXPECT_THAT(jump->to, PoseNear(expected * Pose2d(0.2, 0.0, 0.0), 1e-9, 1e-9));
}

TEST(PoseKeeper, AMotionThatNoVehicleMakesIsTheOneBefore) {
    PoseKeeper keeper;
    keeper.hold(belief({}, 0.001, 0.001));
    keeper.carry(0.0, {});
    keeper.carry(kInterval, {0.05, 0.0, 0.0});
    keeper.carry(2.0 * kInterval, {0.9, 0.0, 0.0});
    EXPECT_THAT(keeper.jump_to({0.95, 0.0, 0.0}).value().from,
                PoseNear(Pose2d(0.1, 0.0, 0.0), 1e-9, 1e-9));
    keeper.carry(3.0 * kInterval, {0.0, 0.0, 0.9});
    EXPECT_THAT(keeper.jump_to({9.0, 0.0, 0.0}).value().from,
                PoseNear(Pose2d(0.15, 0.0, 0.0), 1e-9, 1e-9));
}

TEST(PoseKeeper, StandingThePoseStaysAsSureAsItWas) {
    PoseKeeper keeper;
    keeper.hold(belief({}, 0.01, radians(1.0)));
    for (int i = 0; i < 1000; ++i) {
        keeper.carry(i * kInterval, {});
    }
    // 0.15 m and three of its sigmas.
    EXPECT_FALSE(keeper.jump_to({0.179, 0.0, 0.0}).has_value());
    EXPECT_TRUE(keeper.jump_to({0.181, 0.0, 0.0}).has_value());
}

TEST(PoseKeeper, AnUnsureHeadingSwingsTheWay) {
    // 10 m on, a degree of heading is 17 cm: beyond what is forgiven at most.
    PoseKeeper keeper;
    keeper.hold(belief({}, 0.001, radians(1.0)));
    for (int i = 0; i <= 100; ++i) {
        keeper.carry(i * kInterval, {0.1, 0.0, 0.0});
    }
    EXPECT_FALSE(keeper.jump_to({10.1, 0.29, 0.0}).has_value());
    EXPECT_TRUE(keeper.jump_to({10.1, 0.31, 0.0}).has_value());
}

}  // namespace
}  // namespace hybrid_slam::test
