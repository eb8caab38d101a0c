// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hybrid_slam/core/occupancy_grid.hpp"
#include "hybrid_slam/core/pose2.hpp"
#include "hybrid_slam/vehicle/forklift.hpp"

namespace hybrid_slam {

/// How far each place of a map is from everything that is not known to be free: occupied and
/// unknown cells, and all that lies outside of the grid.
class ClearanceField {
  public:
    /// Throws Error for a grid whose states do not fit its geometry.
    explicit ClearanceField(const StateGrid& grid);

    /// Metres from a point in the map's frame to the nearest edge of what is not free. Never more
    /// than the truth, and at most a diagonal of a cell less; exact at the middles of cells.
    /// 0 or less where the point may be in the way of something.
    double at(const Point2& point) const;

    const GridGeometry& geometry() const { return geometry_; }
    Pose2d grid_from_map() const { return grid_from_map_; }

  private:
    GridGeometry geometry_;
    Pose2d grid_from_map_;          ///< origin at the grid's lower left corner, along its rows
    std::vector<float> distances_;  ///< metres, from the middle of each cell
};

/// Whether the vehicle's rectangle at a pose stays more than `margin` metres away from all that is
/// not free. Never optimistic; refuses at most about a cell too early.
bool footprint_is_clear(const ClearanceField& field, const VehicleConfig& vehicle,
                        const Pose2d& map_from_robot, double margin);

/// Metres that the rectangle is away from all that is not free, to within `tolerance` and never
/// more than the truth; at most `most`, and 0 for one that touches.
double footprint_clearance(const ClearanceField& field, const VehicleConfig& vehicle,
                           const Pose2d& map_from_robot, double most, double tolerance = 0.01);

}  // namespace hybrid_slam
