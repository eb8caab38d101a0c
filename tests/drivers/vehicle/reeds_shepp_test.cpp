// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vehicle/reeds_shepp.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

std::vector<Pose2d> random_goals(int count, double reach) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> place(-reach, reach);
    std::uniform_real_distribution<double> heading(-kPi, kPi);
    std::vector<Pose2d> goals;
    for (int i = 0; i < count; ++i) {
        goals.emplace_back(place(random), place(random), heading(random));
    }
    return goals;
}

TEST(ReedsShepp, EveryWayEndsAtTheGoalAndTheyAreSorted) {
    for (const double reach : {1.0, 8.0}) {
        for (const Pose2d& goal : random_goals(300, reach)) {
            const std::vector<Arcs> ways = reeds_shepp_ways(goal, 0.7);
            ASSERT_FALSE(ways.empty());
            double last = 0.0;
            for (const Arcs& arcs : ways) {
                ASSERT_THAT(end_of(arcs), PoseNear(goal, 1e-5, 1e-5));
                ASSERT_GE(length_of(arcs), last - 1e-9);
                last = length_of(arcs);
            }
            EXPECT_NEAR(reeds_shepp_length(goal, 0.7), length_of(ways.front()), 1e-9);
        }
    }
}

TEST(ReedsShepp, IsNeverShorterThanTheStraightLineNorThanTheTurn) {
    for (const Pose2d& goal : random_goals(300, 3.0)) {
        const double length = reeds_shepp_length(goal, 0.7);
        EXPECT_GE(length, goal.translation.norm() - 1e-9);
        EXPECT_GE(length, 0.7 * std::abs(goal.heading) - 1e-9);
    }
}

/// The same length back, mirrored, and with forward and backward exchanged.
TEST(ReedsShepp, IsSymmetric) {
    for (const Pose2d& goal : random_goals(300, 3.0)) {
        const double length = reeds_shepp_length(goal, 1.0);
        EXPECT_NEAR(reeds_shepp_length(goal.inverse(), 1.0), length, 1e-6) << goal;
        const Pose2d mirrored(goal.x(), -goal.y(), -goal.heading);
        EXPECT_NEAR(reeds_shepp_length(mirrored, 1.0), length, 1e-6) << goal;
        const Pose2d exchanged(-goal.x(), goal.y(), -goal.heading);
        EXPECT_NEAR(reeds_shepp_length(exchanged, 1.0), length, 1e-6) << goal;
        const Pose2d scaled(2.5 * goal.x(), 2.5 * goal.y(), goal.heading);
        EXPECT_NEAR(reeds_shepp_length(scaled, 2.5), 2.5 * length, 1e-6) << goal;
    }
}

/// A shortest way is not longer than any way over a place between.
TEST(ReedsShepp, ObeysTheTriangleInequality) {
    const std::vector<Pose2d> goals = random_goals(60, 3.0);
    for (const Pose2d& middle : goals) {
        for (const Pose2d& goal : goals) {
            const double over =
                reeds_shepp_length(middle, 1.0) + reeds_shepp_length(between(middle, goal), 1.0);
            ASSERT_LE(reeds_shepp_length(goal, 1.0), over + 1e-6) << middle << goal;
        }
    }
}

TEST(ReedsShepp, KnownLengths) {
    EXPECT_NEAR(reeds_shepp_length(Pose2d(), 1.0), 0.0, 1e-9);
    EXPECT_NEAR(reeds_shepp_length({3.0, 0.0, 0.0}, 1.0), 3.0, 1e-9);
    EXPECT_NEAR(reeds_shepp_length({-3.0, 0.0, 0.0}, 1.0), 3.0, 1e-9);
    EXPECT_NEAR(reeds_shepp_length({1.0, 1.0, kPi / 2.0}, 1.0), kPi / 2.0, 1e-9);
    // Turning on the spot: three curves of 60 degrees.
    EXPECT_NEAR(reeds_shepp_length({0.0, 0.0, kPi}, 1.0), kPi, 1e-9);
}

TEST(WaysToPosition, EndThereWithTheRadiusThatWasAsked) {
    for (const Pose2d& goal : random_goals(300, 4.0)) {
        for (const Arcs& arcs : ways_to_position(goal.translation, 0.7)) {
            EXPECT_LT((end_of(arcs).translation - goal.translation).norm(), 1e-9);
            EXPECT_GE(length_of(arcs), goal.translation.norm() - 1e-9);
            EXPECT_NEAR(std::abs(arcs.front().curvature), 1.0 / 0.7, 1e-12);
        }
    }
    EXPECT_EQ(ways_to_position({5.0, 1.0}, 0.7).size(), 8U);
    EXPECT_EQ(ways_to_position({0.0, 0.7}, 0.7).size(), 4U) << "the middle of one circle";
}

TEST(ReedsShepp, RefusesARadiusThatIsNone) {
    EXPECT_EQ(error_of([] { reeds_shepp_ways(Pose2d(1.0, 0.0, 0.0), 0.0); }),
              "turning radius must be positive");
    EXPECT_NE(error_of([] { reeds_shepp_length(Pose2d(1.0, 0.0, 0.0), NAN); }), "");
}

}  // namespace
}  // namespace hybrid_slam::test
