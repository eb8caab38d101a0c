// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "hybrid_slam/can/drive_layout.hpp"

namespace hybrid_slam {

// Both directions of what a layout says of signs, gear and wheel; rpm are the motor's, with sign.

double rpm_from_speed(const DriveLayout& layout, double speed, double steering);
double speed_from_rpm(const DriveLayout& layout, double rpm, double steering);

/// The angle to work a wheel's speed out with: while the wheel still turns it is not where it was
/// told to be, and the straighter of both never makes the axle faster than asked.
double straighter(double commanded, std::optional<double> measured);

/// In degrees as the truck counts them, and back.
double truck_degrees(const DriveLayout& layout, double steering);
double steering_from(const DriveLayout& layout, double truck_degrees);

}  // namespace hybrid_slam
