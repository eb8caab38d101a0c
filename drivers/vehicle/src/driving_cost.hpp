// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "hybrid_slam/vehicle/planner.hpp"
#include "hybrid_slam/vehicle/reeds_shepp.hpp"

namespace hybrid_slam {

/// Where a drive has come to, and how the wheel stands there.
struct DrivingState {
    Pose2d map_from_robot;
    double curvature = 0.0;
    int direction = 0;     ///< 0: not driven yet
    bool leaving = false;  ///< began within the margin and is not out of it yet
};

/// What it costs a vehicle to drive arcs, and whether it can.
class DrivingCost {
  public:
    DrivingCost(const ClearanceField& field, const VehicleConfig& vehicle,
                const PlannerConfig& config);

    /// The state of standing at a pose; none when the vehicle touches something there.
    std::optional<DrivingState> stand(const Pose2d& map_from_robot);

    /// Drives one arc. None when it comes too near to something; else the cost, with `state` at
    /// the end of the arc.
    std::optional<double> drive(DrivingState& state, const Arc& arc) const;
    std::optional<double> drive(DrivingState& state, const Arcs& arcs) const;

    /// The cost without looking at walls: no drive is cheaper.
    double least_cost(DrivingState state, const Arcs& arcs) const;

    bool is_clear(const Pose2d& map_from_robot) const;
    double radius() const { return radius_; }

  private:
    double steering_cost(DrivingState& state, const Arc& arc) const;
    double wall_cost(const Pose2d& map_from_robot) const;
    bool may_be_at(const Pose2d& map_from_robot, bool& leaving) const;

    const ClearanceField& field_;
    const VehicleConfig& vehicle_;
    const PlannerConfig& config_;
    double radius_;
    double reach_;               ///< metres from the origin to the farthest corner
    double leaving_margin_ = 0;  ///< metres, while leaving the margin
};

}  // namespace hybrid_slam
