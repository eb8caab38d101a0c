// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hybrid_slam/core/points.hpp"
#include "hybrid_slam/vehicle/forklift.hpp"
#include "motion.hpp"

namespace hybrid_slam {

struct ForkliftDriveConfig {
    double speed = 0.3;      ///< m/s
    double turn_rate = 0.5;  ///< rad/s at most
};

/// What a driver does who steers a forklift along a polyline by pure pursuit (Coulter 1992), from
/// standstill to standstill, within the limits of the vehicle.
class ForkliftDrive final : public Motion {
  public:
    /// Starts at the first point, heading for the second. Throws Error when the vehicle cannot get
    /// along the path.
    ForkliftDrive(const Points& path, const VehicleConfig& vehicle,
                  const ForkliftDriveConfig& config);

    double duration() const;                              ///< seconds
    Pose2d world_from_robot(double time) const override;  ///< clamped to the drive
    Eigen::Vector3d twist(double time) const override;

  private:
    VehicleConfig vehicle_;
    std::vector<VehicleState> states_;  ///< kStep apart
};

}  // namespace hybrid_slam
