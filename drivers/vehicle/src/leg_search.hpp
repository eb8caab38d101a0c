// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "driving_cost.hpp"

namespace hybrid_slam {

/// A way from one place to one goal.
struct Leg {
    PlanStatus status = PlanStatus::kNoWay;
    Arcs arcs;
    int nodes = 0;
};

/// What every search in one map with one vehicle shares.
struct SearchSpace {
    const ClearanceField& field;
    const VehicleConfig& vehicle;
    const PlannerConfig& config;
};

/// `start` as DrivingCost::stand gives it.
Leg search_leg(const SearchSpace& space, const DrivingCost& driving, const DrivingState& start,
               const Waypoint& goal);

/// The cheapest way to the goal without a search that is clear and costs less than `most`; its
/// cost is put there.
Arcs shoot(const DrivingCost& driving, const DrivingState& from, const Waypoint& goal,
           double& most);

}  // namespace hybrid_slam
