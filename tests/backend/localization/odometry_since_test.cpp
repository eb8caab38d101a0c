// SPDX-License-Identifier: Apache-2.0
#include "odometry_since.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

/// A scan at x along local, with sigma 3 mm along and across.
OdometryResult scan_at_x(double x, bool keyframe = false) {
    OdometryResult scan;
    scan.status = OdometryStatus::kAligned;
    scan.local_from_robot = {x, 0.0, 0.0};
    scan.before_from_now = {0.1, 0.0, 0.0};
    scan.covariance = Eigen::Vector3d(9e-6, 9e-6, 1e-6).asDiagonal();
    scan.keyframe = keyframe;
    scan.icp.status = IcpStatus::kConverged;
    scan.icp.weakness_ratio = 0.9;
    scan.icp.weak_direction = {1.0, 0.0};
    return scan;
}

double sigma_along(const MotionBelief& motion) {
    return std::sqrt(motion.covariance(0, 0));
}

TEST(OdometrySince, TheMotionIsSeenFromTheNode) {
    OdometryResult node = scan_at_x(1.0);
    node.local_from_robot = {1.0, 2.0, 0.5};
    OdometrySince since(node);
    OdometryResult now = scan_at_x(0.0);
    now.local_from_robot = node.local_from_robot * Pose2d(0.3, 0.1, -0.2);
    EXPECT_THAT(since.motion(now).before_from_now, PoseNear(Pose2d(0.3, 0.1, -0.2), 1e-12, 1e-12));
}

TEST(OdometrySince, BothEndsErr) {
    const OdometrySince since(scan_at_x(0.0));
    EXPECT_NEAR(sigma_along(since.motion(scan_at_x(0.1))), std::sqrt(2.0) * 0.003, 5e-4);
    const OdometrySince at_keyframe(scan_at_x(0.0, true));
    EXPECT_NEAR(sigma_along(at_keyframe.motion(scan_at_x(0.1))), 0.003, 5e-4);
}

TEST(OdometrySince, KeyframesAddUpAndANodeStartsAnew) {
    OdometrySince since(scan_at_x(0.0, true));
    for (int i = 1; i <= 4; ++i) {
        since.pass(scan_at_x(0.1 * i, i % 2 == 0), false);
    }
    const MotionBelief far = since.motion(scan_at_x(0.5));
    EXPECT_NEAR(sigma_along(far), std::sqrt(3.0) * 0.003, 1e-3);
    // The heading's error swings the way driven since.
    EXPECT_GT(far.covariance(1, 1), far.covariance(0, 0));
    since.pass(scan_at_x(0.5, true), true);
    EXPECT_NEAR(sigma_along(since.motion(scan_at_x(0.6))), 0.003, 5e-4);
}

TEST(OdometrySince, WhereScansDoNotHoldItMaySlipUnlessVisionLeads) {
    const auto sigma_after = [](PriorKind prior, double weakness) {
        OdometrySince since(scan_at_x(0.0, true));
        OdometryResult scan = scan_at_x(0.0);
        for (int i = 1; i <= 5; ++i) {
            scan = scan_at_x(0.1 * i);
            scan.prior_used = prior;
            scan.icp.weakness_ratio = weakness;
            if (i < 5) {
                since.pass(scan, false);
            }
        }
        return since.motion(scan);
    };
    EXPECT_GT(sigma_along(sigma_after(PriorKind::kWheel, 0.02)), 0.2);
    EXPECT_LT(sigma_along(sigma_after(PriorKind::kVisual, 0.02)), 0.015);
    EXPECT_LT(sigma_along(sigma_after(PriorKind::kWheel, 0.5)), 0.005);
    EXPECT_LT(std::sqrt(sigma_after(PriorKind::kWheel, 0.02).covariance(1, 1)), 0.005);
}

/// The motion since the scan before is told in the axes of that scan: along local's y here, where
/// walls hold it.
TEST(OdometrySince, WhatSlipsIsTheWayInLocal) {
    const OdometrySince since(scan_at_x(0.0));
    OdometryResult turned = scan_at_x(0.0);
    turned.icp.weakness_ratio = 0.0;
    turned.local_from_robot = {0.0, 0.1, 0.0};
    turned.before_from_now = between(Pose2d(0.0, 0.0, kPi / 2.0), turned.local_from_robot);
    EXPECT_LT(sigma_along(since.motion(turned)), 0.006);
    turned.local_from_robot = {0.1, 0.0, 0.0};
    turned.before_from_now = between(Pose2d(0.0, 0.0, kPi / 2.0), turned.local_from_robot);
    EXPECT_NEAR(sigma_along(since.motion(turned)), 0.05, 0.002);
}

}  // namespace
}  // namespace hybrid_slam::test
