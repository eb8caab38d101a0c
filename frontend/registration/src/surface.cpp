// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/registration/surface.hpp"

#include <cmath>
#include <utility>

namespace hybrid_slam {

namespace {

// Sums over a run of neighbouring points, enough for their mean and scatter.
struct Scatter {
    double count = 0.0;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double xx = 0.0, xy = 0.0, yy = 0.0;

    void add(const Point2& p) {
        count += 1.0;
        sum += p;
        xx += p.x() * p.x();
        xy += p.x() * p.y();
        yy += p.y() * p.y();
    }
};

// The unit eigenvector of the smaller eigenvalue, or zero when the run is not drawn out enough.
Eigen::Vector2d across(const Scatter& s, double max_spread) {
    const Eigen::Vector2d mean = s.sum / s.count;
    const double a = s.xx / s.count - mean.x() * mean.x();
    const double b = s.xy / s.count - mean.x() * mean.y();
    const double c = s.yy / s.count - mean.y() * mean.y();
    const double middle = 0.5 * (a + c);
    const double radius = std::hypot(0.5 * (a - c), b);
    const double large = middle + radius;
    const double small = std::max(middle - radius, 0.0);
    if (large <= 0.0 || small > max_spread * max_spread * large) {
        return Eigen::Vector2d::Zero();
    }
    const double along = 0.5 * std::atan2(2.0 * b, a - c);
    return {-std::sin(along), std::cos(along)};
}

}  // namespace

void Surface::append(const Surface& other) {
    points.insert(points.end(), other.points.begin(), other.points.end());
    normals.insert(normals.end(), other.normals.begin(), other.normals.end());
}

Surface oriented(const Surface& surface) {
    Surface kept;
    for (std::size_t i = 0; i < surface.size(); ++i) {
        if (!surface.normals[i].isZero(0.0)) {
            kept.points.push_back(surface.points[i]);
            kept.normals.push_back(surface.normals[i]);
        }
    }
    return kept;
}

Surface transform(const Pose2d& a_from_b, const Surface& surface_in_b) {
    return {transform(a_from_b, surface_in_b.points),
            transform(Pose2d(0.0, 0.0, a_from_b.heading), surface_in_b.normals)};
}

Surface with_normals(Points points, const Point2& viewpoint, const NormalConfig& config) {
    Points normals(points.size(), Point2::Zero());
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double radius =
            std::max(config.radius, config.radius_per_metre * (points[i] - viewpoint).norm());
        const auto near = [&](std::size_t j) {
            return (points[i] - points[j]).squaredNorm() <= radius * radius;
        };
        Scatter scatter;
        // Coordinates relative to the point itself keep the sums well conditioned far from the
        // origin.
        scatter.add(Point2::Zero());
        for (std::size_t j = i + 1; j < points.size() && near(j); ++j) {
            scatter.add(points[j] - points[i]);
        }
        for (std::size_t j = i; j-- > 0 && near(j);) {
            scatter.add(points[j] - points[i]);
        }
        if (scatter.count < 3.0) {
            continue;
        }
        Eigen::Vector2d normal = across(scatter, config.max_spread);
        if (normal.dot(viewpoint - points[i]) < 0.0) {
            normal = -normal;
        }
        normals[i] = normal;
    }
    return {std::move(points), std::move(normals)};
}

Reference::Reference(Surface surface) : surface_(std::move(surface)), neighbors_(surface_.points) {}

}  // namespace hybrid_slam
