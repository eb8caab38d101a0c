// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid_slam/simulator/simulated_vehicle.hpp"

namespace hybrid_slam {

/// The same config. Throws Error with the key when it or the robot cannot be simulated.
SimulatedDriveConfig checked_drive(SimulatedDriveConfig config, const RobotConfig& robot);

}  // namespace hybrid_slam
