// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid_slam/core/points.hpp"
#include "hybrid_slam/vehicle/forklift.hpp"

namespace hybrid_slam {

/// Where the vehicle's rectangle would go if the wheel stayed where it is.
struct Corridor {
    double steering = 0.0;  ///< radians
    int direction = 1;      ///< -1 is backwards
    double margin = 0.05;   ///< metres to each side of the rectangle
    double most = 5.0;      ///< metres; farther on nobody looks
};

/// Metres of the fixed axle's way until the rectangle meets the first of `obstacles`, which are
/// points in the robot's frame; 0 when one is inside of it already, `corridor.most` when none is
/// met by then. Exact: points turn about the centre that the vehicle turns about, until their
/// circle cuts an edge of the rectangle.
double free_way(const VehicleConfig& vehicle, const Corridor& corridor, const Points& obstacles);

}  // namespace hybrid_slam
