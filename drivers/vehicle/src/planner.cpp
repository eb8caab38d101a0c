// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vehicle/planner.hpp"

#include <algorithm>
#include <cmath>

#include "driving_cost.hpp"
#include "hybrid_slam/core/error.hpp"
#include "leg_search.hpp"
#include "shortcuts.hpp"

namespace hybrid_slam {
namespace {

constexpr double kSampling = 0.05;  ///< metres between points of a way

void check(const VehicleConfig& vehicle, const PlannerConfig& config) {
    const bool makes_sense = vehicle.wheelbase != 0.0 && vehicle.steering_limit > 0.0 &&
                             vehicle.steering_limit < kPi / 2.0 && vehicle.footprint_front >= 0.0 &&
                             vehicle.footprint_rear >= 0.0 && vehicle.footprint_width >= 0.0 &&
                             config.steering_share > 0.0 && config.steering_share <= 1.0 &&
                             config.margin >= 0.0 && config.near_walls > 0.0 && config.cell > 0.0 &&
                             config.headings >= 8 && config.greed >= 1.0;
    if (!makes_sense) {
        throw Error("planner: vehicle or search of an impossible size");
    }
}

bool is_finite(const Pose2d& pose) {
    return pose.vector().allFinite();
}

bool goal_is_clear(const DrivingCost& driving, const Waypoint& goal, int headings) {
    if (goal.heading) {
        return driving.is_clear(Pose2d(goal.position, *goal.heading));
    }
    for (int i = 0; i < headings; ++i) {
        if (driving.is_clear(Pose2d(goal.position, 2.0 * kPi * i / headings))) {
            return true;
        }
    }
    return false;
}

/// Neighbours that are one drive become one arc, and nothing is left of arcs without a length.
Arcs merged(const Arcs& arcs) {
    Arcs result;
    for (const Arc& arc : arcs) {
        if (std::abs(arc.length) < 1e-9) {
            continue;
        }
        const bool goes_on = !result.empty() && result.back().curvature == arc.curvature &&
                             (result.back().length < 0.0) == (arc.length < 0.0);
        if (goes_on) {
            result.back().length += arc.length;
        } else {
            result.push_back(arc);
        }
    }
    return result;
}

void append(Route& route, const Arcs& arcs) {
    for (const Arc& arc : arcs) {
        const int steps =
            std::max(1, static_cast<int>(std::ceil(std::abs(arc.length) / kSampling)));
        const double piece = arc.length / steps;
        const int direction = arc.length < 0.0 ? -1 : 1;
        if (route.points.size() > 1 && route.points.back().direction != direction) {
            ++route.reversals;
        }
        for (int i = 0; i < steps; ++i) {
            PathPoint& last = route.points.back();
            last.curvature = arc.curvature;
            last.direction = direction;
            PathPoint next = last;
            next.map_from_robot =
                last.map_from_robot * Pose2d::exp({piece, 0.0, piece * arc.curvature});
            next.travelled += std::abs(piece);
            route.points.push_back(next);
        }
        route.length = route.points.back().travelled;
    }
    route.waypoint_ends.push_back(route.points.size() - 1);
}

Leg plan_leg(const SearchSpace& space, const DrivingCost& driving, const DrivingState& start,
             const Waypoint& goal) {
    Leg leg;
    if (!goal_is_clear(driving, goal, space.config.headings)) {
        leg.status = PlanStatus::kGoalBlocked;
        return leg;
    }
    leg = search_leg(space, driving, start, goal);
    if (leg.status == PlanStatus::kFound) {
        leg.arcs = merged(with_shortcuts(driving, start, goal, leg.arcs));
    }
    return leg;
}

}  // namespace

void describe(ConfigSchema& schema, PlannerConfig& config) {
    schema.add("steering_share", config.steering_share, 0.05, 1.0,
               "of the steering limit that is planned; the follower needs the rest");
    schema.add("margin", config.margin, 0.0, 5.0, "m between the footprint and what is not free");
    schema.add("near_walls", config.near_walls, 0.01, 10.0,
               "m within which walls make a way dearer");
    schema.add("wall_cost", config.wall_cost, 0.0, 100.0, "more per metre right at a wall");
    schema.add("reverse_cost", config.reverse_cost, 0.0, 100.0, "more per metre backwards");
    schema.add("turning_cost", config.turning_cost, 0.0, 100.0,
               "more per metre at the sharpest turn");
    schema.add("cusp_cost", config.cusp_cost, 0.0, 100.0, "m, of a change of direction");
    schema.add("steering_cost", config.steering_cost, 0.0, 100.0,
               "m, of turning the wheel from straight to the sharpest turn");
    schema.add("cell", config.cell, 0.02, 1.0, "m, of the search");
    schema.add("headings", config.headings, 8, 720, "in a full turn, of the search");
    schema.add("greed", config.greed, 1.0, 10.0, "of the search; 1 finds the cheapest way, later");
    schema.add("max_nodes", config.max_nodes, 1, 100000000, "of a leg that is then given up");
    schema.add("improve_nodes", config.improve_nodes, 0, 100000000,
               "spent on a cheaper way than the first");
}

double planned_radius(const VehicleConfig& vehicle, const PlannerConfig& config) {
    return std::abs(vehicle.wheelbase) / std::tan(config.steering_share * vehicle.steering_limit);
}

Route plan_route(const ClearanceField& field, const VehicleConfig& vehicle, const Pose2d& start,
                 const std::vector<Waypoint>& waypoints, const PlannerConfig& config) {
    check(vehicle, config);
    bool all_finite = is_finite(start);
    for (const Waypoint& waypoint : waypoints) {
        all_finite =
            all_finite && is_finite(Pose2d(waypoint.position, waypoint.heading.value_or(0.0)));
    }
    if (!all_finite) {
        throw Error("planner: a place that is not finite");
    }
    Route route;
    DrivingCost driving(field, vehicle, config);
    std::optional<DrivingState> state = driving.stand(start);
    if (!state) {
        route.status = PlanStatus::kStartBlocked;
        return route;
    }
    PathPoint first;
    first.map_from_robot = start;
    route.points.push_back(first);
    for (const Waypoint& waypoint : waypoints) {
        const Leg leg = plan_leg({field, vehicle, config}, driving, *state, waypoint);
        route.nodes += leg.nodes;
        route.status = leg.status;
        if (leg.status != PlanStatus::kFound) {
            return route;
        }
        append(route, leg.arcs);
        ++route.failed_waypoint;
        driving.drive(*state, leg.arcs);
    }
    route.status = PlanStatus::kFound;
    return route;
}

}  // namespace hybrid_slam
