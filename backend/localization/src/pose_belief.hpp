// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {

/// Where the robot is held to be, with the covariance of (x, y, heading) in the axes of the map.
struct PoseBelief {
    Pose2d map_from_robot;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

/// Whether the pose is finite, and its covariance one: symmetric, and positive but for rounding.
inline bool is_sound(const PoseBelief& belief) {
    constexpr double kRounding = 1e-12;  // m2, rad2
    const Eigen::Matrix3d& covariance = belief.covariance;
    if (!belief.map_from_robot.vector().allFinite() || !covariance.allFinite() ||
        !covariance.isApprox(covariance.transpose(), 1e-6)) {
        return false;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance, Eigen::EigenvaluesOnly);
    return eigen.eigenvalues()(0) >= -kRounding;
}

}  // namespace hybrid_slam
