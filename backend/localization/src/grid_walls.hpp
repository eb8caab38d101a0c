// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid_slam/core/occupancy_grid.hpp"
#include "hybrid_slam/registration/surface.hpp"

namespace hybrid_slam {

/// The walls of a grid: its borders between occupied and free cells, straightened over short
/// stretches, with normals to the free side. In the frame of the map (origin_yaw counts).
/// A border lies half a cell inside of the occupied cells, since a beam ends anywhere in the cell
/// that it fills. Throws Error when there is none.
Surface walls_of(const StateGrid& grid);

/// The same grid with its axes along those of the map. A cell that an occupied cell reaches well
/// into is occupied, so that turned walls stay closed.
StateGrid turned_upright(const StateGrid& grid);

}  // namespace hybrid_slam
