// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {

using Point2 = Eigen::Vector2d;  ///< metres
using Points = std::vector<Point2>;

/// The same points, their coordinates taken from frame b to frame a.
inline Points transform(const Pose2d& a_from_b, const Points& points_in_b) {
    const Eigen::Matrix2d rotation = a_from_b.rotation();
    Points points_in_a(points_in_b.size());
    for (std::size_t i = 0; i < points_in_b.size(); ++i) {
        points_in_a[i] = rotation * points_in_b[i] + a_from_b.translation;
    }
    return points_in_a;
}

/// The a_from_b that minimises sum w_i |a_i - a_from_b b_i|^2, by the SVD of the cross-covariance
/// (thesis equations 3.7 to 3.10, with the proper order of U and V and the test for a reflection).
/// Without weights all pairs count alike. Throws Error for fewer than two pairs or unequal sizes.
Pose2d align_points(const Points& points_in_a, const Points& points_in_b,
                    const std::vector<double>& weights = {});

}  // namespace hybrid_slam
