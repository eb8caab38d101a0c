// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/points.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <string>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

void check_pairs(const Points& a, const Points& b, const std::vector<double>& weights) {
    if (a.size() != b.size() || (!weights.empty() && weights.size() != a.size())) {
        throw Error("align_points: " + std::to_string(a.size()) + " points, " +
                    std::to_string(b.size()) + " partners and " + std::to_string(weights.size()) +
                    " weights do not pair up");
    }
    if (a.size() < 2) {
        throw Error("align_points: needs at least 2 pairs, got " + std::to_string(a.size()));
    }
}

}  // namespace

Pose2d align_points(const Points& points_in_a, const Points& points_in_b,
                    const std::vector<double>& weights) {
    check_pairs(points_in_a, points_in_b, weights);
    const auto weight = [&weights](std::size_t i) { return weights.empty() ? 1.0 : weights[i]; };

    // Thesis section 3.5.2.2: the centroids, and the points relative to them.
    double total = 0.0;
    Point2 centroid_a = Point2::Zero();
    Point2 centroid_b = Point2::Zero();
    for (std::size_t i = 0; i < points_in_a.size(); ++i) {
        total += weight(i);
        centroid_a += weight(i) * points_in_a[i];
        centroid_b += weight(i) * points_in_b[i];
    }
    if (!(total > 0.0)) {
        throw Error("align_points: the weights sum up to " + std::to_string(total));
    }
    centroid_a /= total;
    centroid_b /= total;

    // W = sum q' p'^T, with q in a and p in b.
    Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
    for (std::size_t i = 0; i < points_in_a.size(); ++i) {
        covariance +=
            weight(i) * (points_in_a[i] - centroid_a) * (points_in_b[i] - centroid_b).transpose();
    }

    // W = U D V^T gives R = U diag(1, det(U V^T)) V^T. The thesis has V U^T, which is the inverse
    // rotation, and no determinant, which keeps a reflection out.
    const Eigen::JacobiSVD<Eigen::Matrix2d> svd(covariance,
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Eigen::Matrix2d u_vt = svd.matrixU() * svd.matrixV().transpose();
    const Eigen::Vector2d signs(1.0, u_vt.determinant() < 0.0 ? -1.0 : 1.0);
    const Eigen::Matrix2d rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
    const double heading = normalize_angle(std::atan2(rotation(1, 0), rotation(0, 0)));
    return {centroid_a - rotation * centroid_b, heading};
}

}  // namespace hybrid_slam
