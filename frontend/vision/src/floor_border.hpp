// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "hybrid_slam/core/measurements.hpp"

namespace hybrid_slam {

/// The nearest obstacle around the camera in each direction, by a scan: nearer is floor, beyond is
/// what stands there.
class FloorBorder {
  public:
    /// `image_from_scan`: the robot at the stamp of the scan seen from where it is at the image;
    /// `camera`: metres, in the robot's frame.
    FloorBorder(const Scan& scan, const Pose2d& image_from_scan, const Eigen::Vector2d& camera);

    /// Metres from the camera, along the floor, to what the scan hit in the direction (robot's
    /// frame, its height does not matter). Empty where the scan hit nothing or looked away.
    std::optional<double> distance(const Eigen::Vector3d& direction) const;

  private:
    std::vector<float> nearest_;  ///< metres by direction; infinity where nothing was hit
};

}  // namespace hybrid_slam
