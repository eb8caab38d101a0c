// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "hybrid_slam/can/drive_codec.hpp"

namespace hybrid_slam {

// The profiles; make_drive_codec chooses.
std::unique_ptr<DriveCodec> make_curtis_codec(const DriveLayout& layout,
                                              const VehicleConfig& vehicle);
std::unique_ptr<DriveCodec> make_cia402_codec(const DriveLayout& layout,
                                              const VehicleConfig& vehicle);

/// Within the vehicle's limits. Throws Error when it is not finite.
DriveCommand within_limits(const VehicleConfig& vehicle, const DriveCommand& command);

/// What both ends of the bus ask of a layout. Throws Error.
void check(const DriveLayout& layout);

}  // namespace hybrid_slam
