// SPDX-License-Identifier: Apache-2.0
#include "sweep_history.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace hybrid_slam::test {
namespace {

OdometryResult seen_at(const Pose2d& before, const Pose2d& now) {
    OdometryResult seen;
    seen.status = OdometryStatus::kAligned;
    seen.prior_used = PriorKind::kWheel;
    seen.local_from_robot = now;
    seen.before_from_now = between(before, now);
    seen.surface.points = {{1.0, 0.0}, {0.0, 1.0}};
    seen.surface.normals = {{-1.0, 0.0}, {0.0, -1.0}};
    return seen;
}

TEST(SweepHistory, StandingIsNoWay) {
    SweepHistory history({10.0, 0.3, radians(15.0)});
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0.0, 0.003);
    Pose2d before;
    for (int i = 0; i < 2000; ++i) {
        const Pose2d now(noise(random), noise(random), noise(random));
        history.add(seen_at(before, now), Point2::Zero());
        before = now;
    }
    EXPECT_LT(history.path(), 0.03);
    EXPECT_LT(history.turn(), 0.03);
    EXPECT_EQ(history.query(10.0).size(), 1U) << "it was all seen from one spot";
}

TEST(SweepHistory, CountsTheWayAndTheTurn) {
    SweepHistory history({10.0, 0.3, radians(15.0)});
    Pose2d before;
    const auto go_to = [&](const Pose2d& now) {
        history.add(seen_at(before, now), Point2::Zero());
        before = now;
    };
    for (int i = 0; i <= 40; ++i) {
        go_to({0.1 * i, 0.0, 0.0});
    }
    EXPECT_NEAR(history.path(), 4.0, 1e-9);
    for (int i = 1; i <= 90; ++i) {
        go_to({4.0, 0.0, radians(1.0 * i)});
    }
    EXPECT_NEAR(history.path(), 4.0, 1e-9);
    EXPECT_NEAR(history.turn(), radians(90.0), 1e-9);
    // There and back is a way too, and forgetting what was seen does not shorten it.
    for (int i = 1; i <= 20; ++i) {
        go_to({4.0 - 0.1 * i, 0.0, radians(90.0)});
    }
    EXPECT_NEAR(history.path(), 6.0, 0.1);
    const double path = history.path();
    history.clear();
    EXPECT_EQ(history.path(), path);
}

TEST(SweepHistory, AsksWithWhatLiesWithinThePath) {
    SweepHistory history({10.0, 0.3, radians(15.0)});
    Pose2d before;
    for (int i = 0; i <= 200; ++i) {
        const Pose2d now(0.1 * i, 0.0, 0.0);
        history.add(seen_at(before, now), Point2::Zero());
        before = now;
    }
    EXPECT_NEAR(static_cast<double>(history.query(3.0).size()), 10.0, 2.0);
    const Query all = history.query(100.0);
    EXPECT_NEAR(static_cast<double>(all.size()), 33.0, 3.0) << "no more than 10 m are kept";
    EXPECT_LT(all.back().origin.x(), -9.0) << "what was seen before lies behind";
    history.forget_beyond(0.0);
    EXPECT_EQ(history.query(100.0).size(), 1U);
}

}  // namespace
}  // namespace hybrid_slam::test
