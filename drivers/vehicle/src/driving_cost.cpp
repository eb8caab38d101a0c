// SPDX-License-Identifier: Apache-2.0
#include "driving_cost.hpp"

#include <algorithm>
#include <cmath>

namespace hybrid_slam {
namespace {

constexpr double kFinest = 0.05;  ///< metres between two looks at the footprint
constexpr double kCoarsest = 0.2;

}  // namespace

DrivingCost::DrivingCost(const ClearanceField& field, const VehicleConfig& vehicle,
                         const PlannerConfig& config)
    : field_(field),
      vehicle_(vehicle),
      config_(config),
      radius_(planned_radius(vehicle, config)),
      reach_(std::hypot(std::max(vehicle.footprint_front, vehicle.footprint_rear),
                        vehicle.footprint_width / 2.0)) {}

std::optional<DrivingState> DrivingCost::stand(const Pose2d& map_from_robot) {
    if (!footprint_is_clear(field_, vehicle_, map_from_robot, 0.0)) {
        return std::nullopt;
    }
    const double clearance = footprint_clearance(field_, vehicle_, map_from_robot, config_.margin);
    // The overhang comes nearer before it goes.
    leaving_margin_ = 0.4 * clearance;
    DrivingState state;
    state.map_from_robot = map_from_robot;
    state.leaving = clearance < config_.margin;
    return state;
}

bool DrivingCost::is_clear(const Pose2d& map_from_robot) const {
    return footprint_is_clear(field_, vehicle_, map_from_robot, config_.margin);
}

bool DrivingCost::may_be_at(const Pose2d& map_from_robot, bool& leaving) const {
    if (is_clear(map_from_robot)) {
        leaving = false;
        return true;
    }
    return leaving && footprint_is_clear(field_, vehicle_, map_from_robot, leaving_margin_);
}

std::optional<double> DrivingCost::drive(DrivingState& state, const Arc& arc) const {
    const double length = std::abs(arc.length);
    // Nothing slips through between two looks while no corner goes farther than two margins.
    const double swing = std::hypot(1.0, reach_ * arc.curvature);
    const double widest =
        state.leaving ? kFinest : std::clamp(2.0 * config_.margin / swing, kFinest, kCoarsest);
    const int steps = std::max(1, static_cast<int>(std::ceil(length / widest)));
    double cost = steering_cost(state, arc);
    const double piece = arc.length / steps;
    const Pose2d motion = Pose2d::exp({piece, 0.0, piece * arc.curvature});
    for (int i = 0; i < steps; ++i) {
        state.map_from_robot = state.map_from_robot * motion;
        if (!may_be_at(state.map_from_robot, state.leaving)) {
            return std::nullopt;
        }
        cost += std::abs(piece) * wall_cost(state.map_from_robot);
    }
    return cost;
}

std::optional<double> DrivingCost::drive(DrivingState& state, const Arcs& arcs) const {
    double total = 0.0;
    for (const Arc& arc : arcs) {
        const std::optional<double> cost = drive(state, arc);
        if (!cost) {
            return std::nullopt;
        }
        total += *cost;
    }
    return total;
}

double DrivingCost::least_cost(DrivingState state, const Arcs& arcs) const {
    double total = 0.0;
    for (const Arc& arc : arcs) {
        total += steering_cost(state, arc);
    }
    return total;
}

/// All but the walls; the state then tells how the wheel stands on this arc.
double DrivingCost::steering_cost(DrivingState& state, const Arc& arc) const {
    const double length = std::abs(arc.length);
    const int direction = arc.length < 0.0 ? -1 : 1;
    double cost = length * (1.0 + config_.turning_cost * std::abs(arc.curvature) * radius_);
    if (direction < 0) {
        cost += config_.reverse_cost * length;
    }
    if (state.direction == -direction) {
        cost += config_.cusp_cost;
    }
    cost += config_.steering_cost * std::abs(arc.curvature - state.curvature) * radius_;
    state.direction = direction;
    state.curvature = arc.curvature;
    return cost;
}

/// From a few discs along the vehicle: near enough to tell the middle of an aisle from its side.
double DrivingCost::wall_cost(const Pose2d& map_from_robot) const {
    if (config_.wall_cost == 0.0) {
        return 0.0;
    }
    const double half_width = vehicle_.footprint_width / 2.0;
    const double front = vehicle_.footprint_front - half_width;
    const double rear = -vehicle_.footprint_rear + half_width;
    double nearest = config_.near_walls;
    for (int i = 0; i < 4; ++i) {
        const Point2 middle(rear + (front - rear) * i / 3.0, 0.0);
        nearest = std::min(nearest, field_.at(map_from_robot * middle) - half_width);
    }
    return config_.wall_cost * (1.0 - std::max(0.0, nearest) / config_.near_walls);
}

}  // namespace hybrid_slam
