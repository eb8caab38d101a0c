// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/odometry/scan_filter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hybrid_slam {

namespace {

Points returns_in_robot(const Scan& scan, const ScanFilterConfig& config,
                        const Eigen::Vector3d& robot_twist) {
    const bool deskew = scan.time_increment != 0.0 && !robot_twist.isZero(0.0);
    const double range_min = std::max(scan.range_min, config.range_min);
    const double range_max = std::min(scan.range_max, config.range_max);
    const Eigen::Matrix2d rotation = scan.robot_from_laser.rotation();
    Points points;
    points.reserve(scan.ranges.size());
    for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
        const double range = scan.ranges[i];
        if (!(range >= range_min && range < range_max)) {
            continue;
        }
        const double angle = scan.angle(i);
        Point2 point = rotation * Point2(range * std::cos(angle), range * std::sin(angle)) +
                       scan.robot_from_laser.translation;
        if (deskew) {
            const double age = static_cast<double>(i) * scan.time_increment;
            point = Pose2d::exp(age * robot_twist) * point;
        }
        points.push_back(point);
    }
    return points;
}

// One of every cluster of points closer than `spacing` to the last one kept. After the normals,
// which profit from all points.
Surface thinned(const Surface& surface, double spacing) {
    Surface kept;
    kept.points.reserve(surface.size());
    kept.normals.reserve(surface.size());
    for (std::size_t i = 0; i < surface.size(); ++i) {
        if (kept.size() > 0 &&
            (surface.points[i] - kept.points.back()).squaredNorm() < spacing * spacing) {
            continue;
        }
        kept.points.push_back(surface.points[i]);
        kept.normals.push_back(surface.normals[i]);
    }
    return kept;
}

}  // namespace

Surface to_surface(const Scan& scan, const ScanFilterConfig& config,
                   const Eigen::Vector3d& robot_twist) {
    Points points = returns_in_robot(scan, config, robot_twist);
    return thinned(
        with_normals(std::move(points), scan.robot_from_laser.translation, config.normals),
        config.spacing);
}

void describe(ConfigSchema& schema, ScanFilterConfig& config) {
    schema.add("range_min", config.range_min, 0.0, 10.0, "m, nearer returns are left out");
    schema.add("range_max", config.range_max, 1.0, 1000.0, "m, farther returns are left out");
    schema.add("spacing", config.spacing, 0.0, 1.0, "m, points closer than this are thinned out");
    schema.add("normal_radius", config.normals.radius, 0.01, 5.0,
               "m, neighbours up to here give the direction of a wall");
    schema.add("normal_radius_per_metre", config.normals.radius_per_metre, 0.0, 1.0,
               "the same, per metre of range");
    schema.add("normal_max_spread", config.normals.max_spread, 0.0, 1.0,
               "no direction when the neighbours spread across by more than this share");
}

}  // namespace hybrid_slam
