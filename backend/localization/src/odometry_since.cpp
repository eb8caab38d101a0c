// SPDX-License-Identifier: Apache-2.0
#include "odometry_since.hpp"

#include <algorithm>
#include <cmath>

#include "hybrid_slam/core/uncertainty.hpp"

namespace hybrid_slam {
namespace {

// Odometry that aligns to a local map errs by at least so much from one node to the next, and by a
// share of the way.
constexpr double kTranslationFloor = 0.001;       // metres
constexpr double kRotationFloor = radians(0.02);  // radians
constexpr double kShare = 0.003;

Eigen::Matrix3d floor_of(const Pose2d& motion) {
    const double translation = kTranslationFloor + kShare * motion.translation.norm();
    const double rotation = kRotationFloor + kShare * std::abs(motion.heading);
    return Eigen::Vector3d(translation * translation, translation * translation,
                           rotation * rotation)
        .asDiagonal();
}

/// Along a corridor, the noise of normals ties a scan to the local map and holds it back against
/// all but a sure prior. The error goes one way from scan to scan, so that distances add up, not
/// variances. Metres, along icp.weak_direction, of the way in local since the scan before.
double slip_of(const OdometryResult& now, const Point2& way) {
    constexpr double kWeak = 0.25;      // ratio, as of a wall at the end seen by 6 % of the beams
    constexpr double kUnledSlip = 0.5;  // share of the way
    constexpr double kVisualSlip = 0.02;
    if (!now.icp.usable() || now.icp.weakness_ratio >= kWeak) {
        return 0.0;
    }
    const double share = now.prior_used == PriorKind::kVisual ? kVisualSlip : kUnledSlip;
    return (1.0 - now.icp.weakness_ratio / kWeak) * share *
           std::abs(now.icp.weak_direction.dot(way));
}

}  // namespace

MotionBelief OdometrySince::motion(const OdometryResult& now) const {
    const Doubt doubt = carried_to(now);
    Eigen::Matrix3d covariance = doubt.until_keyframe + now.covariance;
    covariance.topLeftCorner<2, 2>() += doubt.slip * doubt.slip;
    MotionBelief motion;
    motion.before_from_now = between(local_from_node_, now.local_from_robot);
    motion.covariance = turned(covariance, now.local_from_robot.rotation().transpose()) +
                        floor_of(motion.before_from_now);
    return motion;
}

void OdometrySince::pass(const OdometryResult& now, bool is_node) {
    if (is_node) {
        doubt_ = Doubt();
        local_from_node_ = now.local_from_robot;
        if (!now.keyframe) {
            // Both ends of the next motion err: the node by what its own scan was off.
            doubt_.until_keyframe = now.covariance;
        }
    } else {
        doubt_ = carried_to(now);
        if (now.keyframe) {
            doubt_.until_keyframe += now.covariance;
        }
    }
    local_from_before_ = now.local_from_robot;
}

OdometrySince::Doubt OdometrySince::carried_to(const OdometryResult& now) const {
    const Point2 way = now.local_from_robot.translation - local_from_before_.translation;
    Doubt doubt;
    doubt.until_keyframe = swung(doubt_.until_keyframe, way);
    doubt.slip = doubt_.slip +
                 slip_of(now, way) * now.icp.weak_direction * now.icp.weak_direction.transpose();
    return doubt;
}

}  // namespace hybrid_slam
