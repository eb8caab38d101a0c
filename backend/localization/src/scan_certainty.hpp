// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "hybrid_slam/core/points.hpp"

namespace hybrid_slam {

/// A point on a wall of the map, in the axes of the map.
struct WallSighting {
    Point2 arm;     ///< metres, from the robot
    Point2 normal;  ///< of the wall; zero when not known
};

/// What of ICP's information is worth anything. The normals of parallel walls err by some degrees,
/// and so even an endless corridor seems to tell a little of the way along it, which over many
/// scans adds up to a lot. Here only walls that really stand across a direction speak for it.
class ScanCertainty {
  public:
    /// `information` of (x, y, heading) in the axes of the map, as ICP found it with `walls`.
    ScanCertainty(const Eigen::Matrix3d& information, const std::vector<WallSighting>& walls);

    Eigen::Matrix3d information() const;

    /// information^-1 gradient, without any step along what is not determined.
    Eigen::Vector3d solve(const Eigen::Vector3d& gradient) const;

  private:
    // By principal directions of (x, y, arm * heading).
    Eigen::DiagonalMatrix<double, 3> scale_;  ///< 1, 1, 1 / arm
    Eigen::Matrix3d directions_ = Eigen::Matrix3d::Identity();
    Eigen::Vector3d claimed_ = Eigen::Vector3d::Zero();
    Eigen::Vector3d shares_ = Eigen::Vector3d::Zero();  ///< of the claimed that holds
};

}  // namespace hybrid_slam
