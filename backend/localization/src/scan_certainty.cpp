// SPDX-License-Identifier: Apache-2.0
#include "scan_certainty.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace hybrid_slam {
namespace {

constexpr double kShortestArm = 1.0;  ///< metres
constexpr double kParallel = 0.35;    ///< cosine to the normal, below which a wall lies along
constexpr double kPostWeight = 0.3;   ///< as ICP weighs points without a normal
/// Share of the strongest direction's information that is taken off all: few beams may have found
/// the wrong one of many alike.
constexpr double kNoise = 0.01;
constexpr double kLeastShare = 0.2;  ///< below it, a direction is not determined

double mean_arm(const std::vector<WallSighting>& walls) {
    double squares = 0.0;
    for (const WallSighting& wall : walls) {
        squares += wall.arm.squaredNorm();
    }
    const double count = static_cast<double>(std::max<std::size_t>(walls.size(), 1));
    return std::max(kShortestArm, std::sqrt(squares / count));
}

/// Sums for one direction what walls tell of it.
struct Testimony {
    double all = 0.0;
    double across = 0.0;  ///< by walls that stand across

    void add(double cosine, double weight) {
        const double told = weight * cosine * cosine;
        all += told;
        across += std::abs(cosine) > kParallel ? told : 0.0;
    }
    double share() const { return all > 0.0 ? across / all : 0.0; }
};

}  // namespace

ScanCertainty::ScanCertainty(const Eigen::Matrix3d& information,
                             const std::vector<WallSighting>& walls)
    : scale_(1.0, 1.0, 1.0 / mean_arm(walls)) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scale_ * information * scale_);
    directions_ = eigen.eigenvectors();
    claimed_ = eigen.eigenvalues().cwiseMax(0.0);
    for (int i = 0; i < 3; ++i) {
        const Eigen::Vector3d direction = scale_ * directions_.col(i);
        Testimony testimony;
        for (const WallSighting& wall : walls) {
            const Point2 moved =
                direction.head<2>() + direction.z() * Point2(-wall.arm.y(), wall.arm.x());
            if (wall.normal.isZero(0.0)) {
                testimony.add(moved.norm(), kPostWeight);
            } else {
                testimony.add(wall.normal.dot(moved), 1.0);
            }
        }
        shares_[i] = testimony.share();
    }
}

Eigen::Matrix3d ScanCertainty::information() const {
    const Eigen::DiagonalMatrix<double, 3> back = scale_.inverse();
    const Eigen::Vector3d kept =
        (claimed_.cwiseProduct(shares_).array() - kNoise * claimed_(2)).max(0.0);
    const Eigen::Matrix3d result =
        back * directions_ * kept.asDiagonal() * directions_.transpose() * back;
    return 0.5 * (result + result.transpose());
}

Eigen::Vector3d ScanCertainty::solve(const Eigen::Vector3d& gradient) const {
    const Eigen::Vector3d along = directions_.transpose() * (scale_ * gradient);
    Eigen::Vector3d step = Eigen::Vector3d::Zero();
    for (int i = 0; i < 3; ++i) {
        if (shares_[i] > kLeastShare && claimed_[i] > 0.0) {
            step += directions_.col(i) * (along[i] / claimed_[i]);
        }
    }
    return scale_ * step;
}

}  // namespace hybrid_slam
