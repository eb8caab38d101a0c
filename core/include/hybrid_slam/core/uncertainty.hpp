// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {

// Covariance and information matrices of a pose are over (x, y, heading): m2, m rad, rad2 or their
// inverses.

/// The matrix with its axes turned by `rotation`: from the axes of b to those of a for the rotation
/// of a_from_b.
inline Eigen::Matrix3d turned(const Eigen::Matrix3d& matrix, const Eigen::Matrix2d& rotation) {
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    turn.topLeftCorner<2, 2>() = rotation;
    return turn * matrix * turn.transpose();
}

/// The covariance carried along `arm` (metres, in the same axes): an error of the heading swings
/// the arm.
inline Eigen::Matrix3d swung(const Eigen::Matrix3d& covariance, const Eigen::Vector2d& arm) {
    Eigen::Matrix3d swing = Eigen::Matrix3d::Identity();
    swing(0, 2) = -arm.y();
    swing(1, 2) = arm.x();
    return swing * covariance * swing.transpose();
}

/// The covariance of the inverse of a pose whose own is `covariance`.
inline Eigen::Matrix3d inverse_covariance(const Pose2d& a_from_b,
                                          const Eigen::Matrix3d& covariance) {
    // d(inverse) / d(x, y, heading), with -R^T t the translation of the inverse.
    const Eigen::Matrix2d turn_back = a_from_b.rotation().transpose();
    const Eigen::Vector2d back = turn_back * a_from_b.translation;
    Eigen::Matrix3d jacobian = Eigen::Matrix3d::Zero();
    jacobian.topLeftCorner<2, 2>() = -turn_back;
    jacobian(0, 2) = -back.y();
    jacobian(1, 2) = back.x();
    jacobian(2, 2) = -1.0;
    return jacobian * covariance * jacobian.transpose();
}

/// x, y and wrapped heading of `a` minus those of `b`: what those matrices weigh.
inline Eigen::Vector3d difference(const Pose2d& a, const Pose2d& b) {
    return {a.x() - b.x(), a.y() - b.y(), normalize_angle(a.heading - b.heading)};
}

}  // namespace hybrid_slam
