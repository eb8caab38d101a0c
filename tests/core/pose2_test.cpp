// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/pose2.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <sstream>
#include <vector>

#include "hybrid_slam/core/points.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam {
namespace {

using test::PoseNear;

constexpr double kTiny = 1e-12;

/// Identity, tiny, near and at the wrap, and random elements.
std::vector<Pose2d> elements() {
    std::vector<Pose2d> poses{{},
                              {1e-9, -1e-9, 1e-9},
                              {1.0, 2.0, kPi},
                              {1.0, 2.0, -kPi},
                              {-3.0, 0.5, std::nextafter(kPi, 0.0)},
                              {4.0, -4.0, -kPi + 1e-9},
                              {0.0, 0.0, 0.5 * kPi},
                              {2.0, -1.0, 0.00999},
                              {2.0, -1.0, 0.01001}};
    std::mt19937 random(1);
    std::uniform_real_distribution<double> metres(-50.0, 50.0);
    std::uniform_real_distribution<double> angle(-kPi, kPi);
    for (int i = 0; i < 20; ++i) {
        poses.emplace_back(metres(random), metres(random), angle(random));
    }
    return poses;
}

TEST(Pose2, NormalizeAngleStaysInItsRangeAndKeepsTheDirection) {
    std::mt19937 random(2);
    std::uniform_real_distribution<double> far(-1000.0, 1000.0);
    std::vector<double> angles{0.0, kPi, -kPi, 3.0 * kPi, -3.0 * kPi, std::nextafter(kPi, 4.0)};
    for (int turns = -9; turns <= 9; ++turns) {
        const double edge = kPi * turns;
        angles.insert(angles.end(), {edge, std::nextafter(edge, -1e9), std::nextafter(edge, 1e9)});
    }
    for (int i = 0; i < 1000; ++i) {
        angles.push_back(far(random));
    }
    for (const double angle : angles) {
        const double wrapped = normalize_angle(angle);
        EXPECT_GE(wrapped, -kPi) << angle;
        EXPECT_LT(wrapped, kPi) << angle;
        EXPECT_NEAR(std::cos(wrapped), std::cos(angle), 1e-12) << angle;
        EXPECT_NEAR(std::sin(wrapped), std::sin(angle), 1e-12) << angle;
        EXPECT_EQ(normalize_angle(wrapped), wrapped);
    }
}

TEST(Pose2, NormalizeAngleLeavesWhatIsInRangeAlone) {
    for (const double angle : {-kPi, -1.0, 0.0, 1e-300, 3.14, std::nextafter(kPi, 0.0)}) {
        EXPECT_EQ(normalize_angle(angle), angle);
    }
    EXPECT_EQ(normalize_angle(kPi), -kPi);
}

TEST(Pose2, DegreesAndRadiansAreInverse) {
    EXPECT_DOUBLE_EQ(radians(180.0), kPi);
    EXPECT_DOUBLE_EQ(degrees(radians(37.0)), 37.0);
}

TEST(Pose2, GroupLaws) {
    const auto poses = elements();
    for (const Pose2d& a : poses) {
        EXPECT_THAT(a * Pose2d(), PoseNear(a, kTiny, kTiny));
        EXPECT_THAT(Pose2d() * a, PoseNear(a, kTiny, kTiny));
        EXPECT_THAT(a * a.inverse(), PoseNear(Pose2d(), kTiny, kTiny));
        EXPECT_THAT(a.inverse() * a, PoseNear(Pose2d(), kTiny, kTiny));
        for (const Pose2d& b : poses) {
            EXPECT_THAT((a * b).inverse(), PoseNear(b.inverse() * a.inverse(), 1e-10, kTiny));
            EXPECT_THAT(between(a, b), PoseNear(a.inverse() * b, 1e-10, kTiny));
            EXPECT_THAT(a * between(a, b), PoseNear(b, 1e-10, kTiny));
            for (const Pose2d& c : poses) {
                ASSERT_THAT((a * b) * c, PoseNear(a * (b * c), 1e-10, 1e-11));
            }
        }
    }
}

TEST(Pose2, ProductsAreWrapped) {
    for (const Pose2d& a : elements()) {
        for (const Pose2d& b : elements()) {
            for (const double heading :
                 {(a * b).heading, a.inverse().heading, between(a, b).heading}) {
                ASSERT_GE(heading, -kPi);
                ASSERT_LT(heading, kPi);
            }
        }
    }
}

TEST(Pose2, ActsOnPointsAsItsMatrix) {
    const Point2 point(0.3, -0.7);
    for (const Pose2d& a : elements()) {
        for (const Pose2d& b : elements()) {
            ASSERT_LT((a * (b * point) - (a * b) * point).norm(), 1e-10);
        }
        const Points moved = transform(a, {point, Point2(0.0, 0.0)});
        EXPECT_LT((moved[0] - a * point).norm(), kTiny);
        EXPECT_LT((moved[1] - a.translation).norm(), kTiny);
    }
    EXPECT_LT((Pose2d(1.0, 2.0, 0.5 * kPi) * Point2(3.0, 0.0) - Point2(1.0, 5.0)).norm(), kTiny);
}

TEST(Pose2, ExpAndLogAreInverse) {
    for (const Pose2d& pose : elements()) {
        EXPECT_THAT(Pose2d::exp(pose.log()), PoseNear(pose, kTiny * 100.0, kTiny));
    }
    for (const double angle :
         {0.0, 1e-300, 1e-12, -1e-6, 9.9e-6, 1.1e-5, 0.009999, 0.010001, 1.0, 3.1, -3.1, -kPi}) {
        const Eigen::Vector3d twist(1.0, -2.0, angle);
        EXPECT_LT((Pose2d::exp(twist).log() - twist).norm(), 1e-13) << angle;
    }
}

TEST(Pose2, ExpIsTheMotionAlongAnArc) {
    // A quarter of a circle of radius 2: ends at (2, 2).
    EXPECT_THAT(Pose2d::exp({kPi, 0.0, 0.5 * kPi}),
                PoseNear(Pose2d(2.0, 2.0, 0.5 * kPi), kTiny, kTiny));
    EXPECT_THAT(Pose2d::exp({1.0, 2.0, 0.0}), PoseNear(Pose2d(1.0, 2.0, 0.0), kTiny, kTiny));
}

TEST(Pose2, ExpIsTheLimitOfManySmallSteps) {
    for (const double angle : {1e-7, 1e-3, 0.5, kPi, -2.0}) {
        const Eigen::Vector3d twist(0.7, -0.2, angle);
        Pose2d stepped;
        constexpr int kSteps = 1000;
        for (int i = 0; i < kSteps; ++i) {
            stepped = stepped * Pose2d::exp(twist / kSteps);
        }
        EXPECT_THAT(stepped, PoseNear(Pose2d::exp(twist), 1e-12, 1e-11)) << angle;
    }
}

TEST(Pose2, ExpHasFullPrecisionForSmallAngles) {
    // The sideways part of an arc, (1 - cos w) / w, cancels when it is computed as written.
    for (double w = 1e-8; w < 0.1; w *= 1.7) {
        const long double half = std::sin(static_cast<long double>(w) / 2.0L);
        const double expected = static_cast<double>(2.0L * half * half / w);
        EXPECT_NEAR(Pose2d::exp({1.0, 0.0, w}).y() / expected, 1.0, 1e-15) << w;
    }
}

TEST(Pose2, AdjointMovesATwistToTheOtherSide) {
    for (const Pose2d& pose : elements()) {
        const Eigen::Vector3d twist(0.1, -0.2, 0.3);
        const Pose2d moved = Pose2d::exp(pose.adjoint() * twist);
        EXPECT_THAT(pose * Pose2d::exp(twist), PoseNear(moved * pose, 1e-10, kTiny));
    }
}

TEST(Pose2, AdjointMatchesNumericDerivative) {
    constexpr double kStep = 1e-6;
    for (const Pose2d& pose : elements()) {
        Eigen::Matrix3d numeric;
        for (int i = 0; i < 3; ++i) {
            const Eigen::Vector3d twist = kStep * Eigen::Vector3d::Unit(i);
            const auto conjugate = [&pose](const Eigen::Vector3d& small) {
                return (pose * Pose2d::exp(small) * pose.inverse()).log();
            };
            numeric.col(i) = (conjugate(twist) - conjugate(-twist)) / (2.0 * kStep);
        }
        EXPECT_LT((numeric - pose.adjoint()).norm(), 1e-6) << pose;
    }
}

TEST(Pose2, InterpolationMeetsItsEndsAndTakesTheShortWayRound) {
    for (const Pose2d& a : elements()) {
        for (const Pose2d& b : elements()) {
            ASSERT_THAT(interpolate(a, b, 0.0), PoseNear(a, 1e-10, kTiny));
            ASSERT_THAT(interpolate(a, b, 1.0), PoseNear(b, 1e-10, kTiny));
        }
    }
    const Pose2d middle = interpolate({0.0, 0.0, radians(170.0)}, {0.0, 0.0, radians(-170.0)}, 0.5);
    EXPECT_THAT(middle, PoseNear(Pose2d(0.0, 0.0, kPi), kTiny, kTiny));
}

TEST(Pose2, CastKeepsTheNumbersAndPrintsThemWithUnits) {
    const Pose2<float> single = Pose2d(1.5, -2.5, 0.25).cast<float>();
    EXPECT_EQ(single.x(), 1.5F);
    EXPECT_EQ(single.heading, 0.25F);
    std::ostringstream out;
    out << Pose2d(1.5, -2.5, radians(90.0));
    EXPECT_EQ(out.str(), "(1.5 m, -2.5 m, 90 deg)");
}

}  // namespace
}  // namespace hybrid_slam
