// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/core/measurements.hpp"
#include "hybrid_slam/registration/surface.hpp"

namespace hybrid_slam {

struct ScanFilterConfig {
    double range_min = 0.05;  ///< metres
    double range_max = 30.0;  ///< metres
    double spacing = 0.03;    ///< metres; of neighbouring points closer than this one is enough
    NormalConfig normals;
};

void describe(ConfigSchema& schema, ScanFilterConfig& config);

/// The points that a scan hit, in the robot's frame at the stamp of the scan, in the order of the
/// beams, with normals. `robot_twist` (m/s, m/s, rad/s) moves each point to where it was at the
/// stamp, when the scan knows the times of its beams; zero leaves the points as measured.
Surface to_surface(const Scan& scan, const ScanFilterConfig& config,
                   const Eigen::Vector3d& robot_twist = Eigen::Vector3d::Zero());

}  // namespace hybrid_slam
