// SPDX-License-Identifier: Apache-2.0
#include "forklift_drive.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/error_of.hpp"

namespace hybrid_slam::test {
namespace {

constexpr double kStep = 0.01;  ///< seconds

Points square(double side) {
    return {{0, 0}, {side, 0}, {side, side}, {0, side}, {0, 0}};
}

double distance_to_square(const Point2& point, double side) {
    const Eigen::Vector2d away = (point - Point2(side / 2, side / 2)).cwiseAbs();
    return std::abs(away.maxCoeff() - side / 2);
}

/// Largest speed, turn rate, changes of both and steering angle of a drive, by differences.
struct Extremes {
    double speed = 0.0;
    double turn_rate = 0.0;
    double acceleration = 0.0;
    double sideways = 0.0;
};

Extremes extremes_of(const ForkliftDrive& drive) {
    Extremes most;
    double last_speed = 0.0;
    for (double time = 0.0; time + kStep <= drive.duration(); time += kStep) {
        const Eigen::Vector3d twist =
            between(drive.world_from_robot(time), drive.world_from_robot(time + kStep)).log() /
            kStep;
        most.speed = std::max(most.speed, std::abs(twist.x()));
        most.turn_rate = std::max(most.turn_rate, std::abs(twist.z()));
        most.sideways = std::max(most.sideways, std::abs(twist.y()));
        most.acceleration = std::max(most.acceleration, std::abs(twist.x() - last_speed) / kStep);
        last_speed = twist.x();
    }
    return most;
}

TEST(ForkliftDrive, FollowsASquareWithinItsLimits) {
    const VehicleConfig vehicle;
    for (const double speed : {0.3, 1.5}) {
        const ForkliftDrive drive(square(8.0), vehicle, {speed, 0.5});
        double worst = 0.0;
        for (double time = 0.0; time < drive.duration(); time += 0.1) {
            worst =
                std::max(worst, distance_to_square(drive.world_from_robot(time).translation, 8.0));
        }
        EXPECT_LT(worst, 0.8) << "corners are cut";
        const Extremes most = extremes_of(drive);
        EXPECT_NEAR(most.speed, speed, 0.01);
        EXPECT_LT(most.turn_rate, 0.55);
        EXPECT_LT(most.sideways, 1e-6) << "wheels do not slip";
        EXPECT_LT(most.acceleration, 1.05 * vehicle.acceleration);
    }
}

TEST(ForkliftDrive, GoesFromStandstillToStandstillAtTheEnds) {
    const ForkliftDrive drive(square(5.0), {}, {0.5, 0.5});
    EXPECT_TRUE(drive.twist(0.0).isZero());
    EXPECT_TRUE(drive.twist(drive.duration()).isZero());
    EXPECT_EQ(drive.world_from_robot(0.2).translation, Point2(0, 0));
    EXPECT_LT(drive.world_from_robot(drive.duration()).translation.norm(), 0.1);
    EXPECT_EQ(drive.world_from_robot(1e9).translation,
              drive.world_from_robot(drive.duration()).translation);
}

TEST(ForkliftDrive, TurnsAroundAtTheEndOfACorridor) {
    const ForkliftDrive drive({{0, 0}, {10, 0}, {0, 0}}, {}, {0.8, 0.5});
    double farthest = 0.0;
    double beside = 0.0;
    for (double time = 0.0; time < drive.duration(); time += 0.1) {
        farthest = std::max(farthest, drive.world_from_robot(time).x());
        beside = std::max(beside, std::abs(drive.world_from_robot(time).y()));
    }
    EXPECT_GT(farthest, 9.5);
    EXPECT_LT(beside, 1.1);
    EXPECT_LT(std::abs(drive.world_from_robot(drive.duration()).x()), 0.3);
}

TEST(ForkliftDrive, TwistIsTheDerivativeOfThePose) {
    const ForkliftDrive drive(square(6.0), {}, {0.6, 0.5});
    for (double time = 1.005; time < drive.duration() - 1.0; time += 0.73) {
        const Eigen::Vector3d measured =
            between(drive.world_from_robot(time - kStep), drive.world_from_robot(time + kStep))
                .log() /
            (2.0 * kStep);
        EXPECT_LT((drive.twist(time) - measured).norm(), 0.03) << time;
    }
}

TEST(ForkliftDrive, SaysWhatItCannotDrive) {
    EXPECT_NE(error_of([] { ForkliftDrive({{1, 1}, {1, 1}}, {}, {0.3, 0.5}); }), "");
    VehicleConfig stiff;
    stiff.steering_limit = radians(1.0);
    EXPECT_NE(error_of([&] { ForkliftDrive({{0, 0}, {3, 0}, {0, 1}}, stiff, {0.3, 0.5}); }), "");
}

}  // namespace
}  // namespace hybrid_slam::test
