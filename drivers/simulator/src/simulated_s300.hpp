// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "fan_caster.hpp"
#include "hybrid_slam/lidar/lidar_config.hpp"
#include "hybrid_slam/lidar/lidar_reader.hpp"
#include "hybrid_slam/simulator/simulated_vehicle.hpp"
#include "motion.hpp"
#include "noise.hpp"

namespace hybrid_slam {

/// The scanner of a simulated drive: one telegram after the other.
class SimulatedS300 {
  public:
    SimulatedS300(const World& world, const Motion& motion, const LidarConfig& lidar,
                  const SimulatedDriveConfig& config);

    double next_stamp() const;  ///< seconds, of the first beam of the next scan
    double next_end() const;    ///< seconds, when the mirror has turned by it

    /// The next scan as it arrives.
    LidarBytes next();

  private:
    std::vector<double> true_ranges() const;
    std::uint16_t word_of(double distance);

    const World& world_;
    const Motion& motion_;
    LidarConfig lidar_;
    SimulatedDriveConfig config_;
    BeamFan fan_;
    Noise range_noise_;
    Noise bus_noise_;
    double period_ = 0.0;  ///< seconds from scan to scan
    std::uint32_t scans_ = 0;
};

}  // namespace hybrid_slam
