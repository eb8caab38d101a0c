// SPDX-License-Identifier: Apache-2.0
#include "pose_keeper.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "hybrid_slam/core/uncertainty.hpp"

namespace hybrid_slam {
namespace {

// A pose that moves by more than this beyond the motion, and beyond its own doubt, is a jump.
constexpr double kJump = 0.15;               // metres, or
constexpr double kJumpAngle = radians(5.0);  // radians
constexpr double kSigmas = 3.0;              // of doubt, up to as much again
// What vehicles for halls do at most.
constexpr double kSpeed = 3.0;     // m/s
constexpr double kTurnRate = 3.0;  // rad/s

double largest_sigma(const Eigen::Matrix3d& covariance) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(covariance.topLeftCorner<2, 2>(),
                                                               Eigen::EigenvaluesOnly);
    return std::sqrt(std::max(0.0, eigen.eigenvalues().maxCoeff()));
}

}  // namespace

void PoseKeeper::carry(double stamp, const Pose2d& before_from_now) {
    const double seconds = stamp_ ? std::max(0.0, stamp - *stamp_) : 0.0;
    stamp_ = stamp;
    if (before_from_now.translation.norm() <= kJump + kSpeed * seconds &&
        std::abs(before_from_now.heading) <= kJumpAngle + kTurnRate * seconds) {
        motion_ = before_from_now;
    }
    if (pose_) {
        const Pose2d now = pose_->map_from_robot * motion_;
        pose_->covariance =
            swung(pose_->covariance, now.translation - pose_->map_from_robot.translation);
        pose_->map_from_robot = now;
    }
}

std::optional<Jump> PoseKeeper::jump_to(const Pose2d& found) const {
    if (!pose_) {
        return std::nullopt;
    }
    const Pose2d apart = between(pose_->map_from_robot, found);
    const double metres = kJump + std::min(kJump, kSigmas * largest_sigma(pose_->covariance));
    const double angle =
        kJumpAngle +
        std::min(kJumpAngle, kSigmas * std::sqrt(std::max(0.0, pose_->covariance(2, 2))));
    if (apart.translation.norm() <= metres && std::abs(apart.heading) <= angle) {
        return std::nullopt;
    }
    return Jump{pose_->map_from_robot, found};
}

}  // namespace hybrid_slam
