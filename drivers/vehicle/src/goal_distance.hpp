// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hybrid_slam/vehicle/clearance.hpp"

namespace hybrid_slam {

/// Metres from anywhere to a goal for a disc that goes around what is not free, along the eight
/// directions of a coarse grid: at most 8 % more than the straight way.
class GoalDistance {
  public:
    /// `disc` is a radius that fits into the vehicle's footprint around its origin.
    GoalDistance(const ClearanceField& field, const Point2& goal, double cell, double disc);

    /// Infinite where there is no way.
    double at(const Point2& point) const;

  private:
    std::vector<char> passable_cells(const ClearanceField& field, double disc) const;
    void spread(const Cell& goal, const std::vector<char>& passable);

    GridGeometry geometry_;  ///< in the field's grid frame, origin at its corner
    Pose2d grid_from_map_;
    std::vector<float> distances_;
};

}  // namespace hybrid_slam
