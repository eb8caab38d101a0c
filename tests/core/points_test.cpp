// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/points.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using test::PoseNear;
using ::testing::HasSubstr;

Points random_points(std::size_t count, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> metres(-10.0, 10.0);
    Points points;
    for (std::size_t i = 0; i < count; ++i) {
        points.emplace_back(metres(random), metres(random));
    }
    return points;
}

double cost(const Pose2d& a_from_b, const Points& a, const Points& b,
            const std::vector<double>& weights) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        sum += weights[i] * (a[i] - a_from_b * b[i]).squaredNorm();
    }
    return sum;
}

TEST(AlignPoints, FindsTheExactMotion) {
    const Points b = random_points(20, 3);
    for (const double heading : {0.0, 1e-7, 0.3, 1.6, 3.1, kPi, -3.1, -1.6}) {
        const Pose2d a_from_b(3.0, -7.0, heading);
        EXPECT_THAT(align_points(transform(a_from_b, b), b), PoseNear(a_from_b, 1e-12, 1e-13));
    }
}

TEST(AlignPoints, TwoPairsAreEnough) {
    const Pose2d a_from_b(1.0, 2.0, -2.0);
    const Points b{{0.0, 0.0}, {1.0, 0.5}};
    EXPECT_THAT(align_points(transform(a_from_b, b), b), PoseNear(a_from_b, 1e-12, 1e-12));
}

TEST(AlignPoints, NoNearbyMotionIsBetterUnderNoiseAndWeights) {
    std::mt19937 random(4);
    std::normal_distribution<double> noise(0.0, 0.5);
    std::uniform_real_distribution<double> weight(0.0, 3.0);
    const Points b = random_points(30, 5);
    Points a = transform({1.0, -1.0, 2.5}, b);
    std::vector<double> weights;
    for (Point2& point : a) {
        point += Point2(noise(random), noise(random));
        weights.push_back(weight(random));
    }
    const Pose2d best = align_points(a, b, weights);
    const double least = cost(best, a, b, weights);
    for (int axis = 0; axis < 3; ++axis) {
        for (const double step : {-1e-3, 1e-3}) {
            const Pose2d beside = best * Pose2d::exp(step * Eigen::Vector3d::Unit(axis));
            EXPECT_GT(cost(beside, a, b, weights), least);
        }
    }
}

TEST(AlignPoints, MirroredPointsGiveARotationAndNoReflection) {
    const Points b = random_points(10, 6);
    Points mirrored = b;
    for (Point2& point : mirrored) {
        point.x() = -point.x();
    }
    const std::vector<double> even(b.size(), 1.0);
    const Pose2d best = align_points(mirrored, b);
    const double least = cost(best, mirrored, b, even);
    for (double heading = -kPi; heading < kPi; heading += 0.01) {
        Pose2d other(0.0, 0.0, heading);
        Point2 offset = Point2::Zero();
        for (std::size_t i = 0; i < b.size(); ++i) {
            offset += mirrored[i] - other * b[i];
        }
        other.translation = offset / static_cast<double>(b.size());
        ASSERT_GE(cost(other, mirrored, b, even), least - 1e-9);
    }
}

TEST(AlignPoints, AWeightOfZeroTakesAnOutlierOut) {
    const Pose2d a_from_b(0.5, 0.25, 0.1);
    const Points b = random_points(6, 7);
    Points a = transform(a_from_b, b);
    a[2] += Point2(100.0, 100.0);
    EXPECT_THAT(align_points(a, b, {1.0, 1.0, 0.0, 1.0, 1.0, 1.0}),
                PoseNear(a_from_b, 1e-12, 1e-12));
}

TEST(AlignPoints, OnePlaceOnlyGivesNoRotation) {
    const Points b(3, Point2(1.0, 1.0));
    const Points a(3, Point2(4.0, 5.0));
    EXPECT_THAT(align_points(a, b), PoseNear(Pose2d(3.0, 4.0, 0.0), 1e-12, 1e-12));
}

TEST(AlignPoints, RefusesWhatDoesNotPairUp) {
    const Points one(1, Point2::Zero());
    const Points two(2, Point2::Zero());
    EXPECT_THAT(error_of([&] { align_points({}, {}); }), HasSubstr("at least 2 pairs, got 0"));
    EXPECT_THAT(error_of([&] { align_points(one, one); }), HasSubstr("at least 2 pairs, got 1"));
    EXPECT_THAT(error_of([&] { align_points(two, one); }), HasSubstr("do not pair up"));
    EXPECT_THAT(error_of([&] { align_points(two, two, {1.0}); }), HasSubstr("do not pair up"));
    EXPECT_THAT(error_of([&] { align_points(two, two, {0.0, 0.0}); }), HasSubstr("weights"));
}

}  // namespace
}  // namespace hybrid_slam
