// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <random>

#include "hybrid_slam/core/measurements.hpp"
#include "hybrid_slam/simulator/world.hpp"

namespace hybrid_slam::test {

/// A scan of a S300 (270 degrees, 0.5 degrees, whole centimetres) that stands still.
inline Scan scan_at(const World& world, const Pose2d& world_from_robot, std::mt19937& random,
                    double sigma = 0.02, const Pose2d& robot_from_laser = {}, double bias = 0.0) {
    Scan scan;
    scan.angle_min = radians(-135.0);
    scan.angle_increment = radians(0.5);
    scan.range_min = 0.05;
    scan.range_max = 29.5;
    scan.robot_from_laser = robot_from_laser;
    std::normal_distribution<double> noise(bias, sigma);
    const Pose2d world_from_laser = world_from_robot * robot_from_laser;
    for (int beam = 0; beam < 541; ++beam) {
        const double heading =
            world_from_laser.heading + scan.angle(static_cast<std::size_t>(beam));
        const double range =
            world.cast_ray(world_from_laser.translation, {std::cos(heading), std::sin(heading)});
        const double error = sigma > 0.0 ? noise(random) : bias;
        scan.ranges.push_back(std::isfinite(range)
                                  ? static_cast<float>(0.01 * std::round((range + error) / 0.01))
                                  : std::numeric_limits<float>::infinity());
    }
    return scan;
}

}  // namespace hybrid_slam::test
