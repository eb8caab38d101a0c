// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/vehicle/clearance.hpp"
#include "hybrid_slam/vehicle/forklift.hpp"

namespace hybrid_slam {

/// Costs are in metres of driving forwards in the open.
struct PlannerConfig {
    double steering_share = 0.8;  ///< of the steering limit; the rest is left to the follower
    double margin = 0.15;         ///< metres kept between the footprint and what is not free
    double near_walls = 0.5;      ///< metres within which walls make the way dearer
    double wall_cost = 1.0;       ///< more per metre right at a wall
    double reverse_cost = 0.1;    ///< more per metre backwards: the forks trail
    double turning_cost = 0.2;    ///< more per metre at the sharpest turn
    double cusp_cost = 0.8;       ///< of each change of direction
    double steering_cost = 0.15;  ///< of turning the wheel from straight to the sharpest turn
    double cell = 0.1;            ///< metres, of the search
    int headings = 72;            ///< in a full turn, of the search
    double greed = 1.5;           ///< of the search; 1 finds the cheapest way, later
    int max_nodes = 200000;       ///< of one leg, after which it is given up
    int improve_nodes = 2000;     ///< spent on finding a cheaper way than the first
};

/// Lists the keys without a section before them.
void describe(ConfigSchema& schema, PlannerConfig& config);

struct Waypoint {
    Point2 position{0.0, 0.0};      ///< metres, of the robot's origin in the map
    std::optional<double> heading;  ///< radians; none: any
};

/// A point of a way and how it goes on from there; the last one repeats the one before.
struct PathPoint {
    Pose2d map_from_robot;
    double curvature = 0.0;  ///< 1/m, heading change per signed length: left positive
    int direction = 1;       ///< -1 is backwards
    double travelled = 0.0;  ///< metres from the start of the way
};

enum class PlanStatus {
    kFound,
    kStartBlocked,  ///< the vehicle touches something where it stands
    kGoalBlocked,   ///< it would within its margin, at every heading that was allowed
    kNoWay,
    kUnfinished,  ///< max_nodes did not suffice
};

/// A way through all waypoints, pieces of constant steering sampled every 5 cm or less. The
/// steering angle may step from one piece to the next: a wheel that turns at 60 deg/s needs 0.3 m
/// for the largest step at 0.3 m/s and cuts the corner by 5 mm, which the follower halves by
/// slowing down. Curvature that is continuous would widen every manoeuvre in a narrow place
/// instead.
struct Route {
    PlanStatus status = PlanStatus::kNoWay;
    std::size_t failed_waypoint = 0;         ///< when not found: the one that was not reached
    std::vector<PathPoint> points;           ///< up to the last waypoint that was reached
    std::vector<std::size_t> waypoint_ends;  ///< for each waypoint, the point that meets it
    double length = 0.0;                     ///< metres
    int reversals = 0;                       ///< changes of direction
    int nodes = 0;                           ///< looked at in all legs
};

/// Hybrid A* (Dolgov et al. 2010) over position and heading, leg by leg: arcs of the vehicle's
/// turning radius both ways, Reeds-Shepp or arc-and-line shots at the goal, then shortcuts between
/// places of the way. The same input gives the same way. Throws Error for values that are not
/// finite or make no sense.
Route plan_route(const ClearanceField& field, const VehicleConfig& vehicle, const Pose2d& start,
                 const std::vector<Waypoint>& waypoints, const PlannerConfig& config = {});

/// Metres; of the sharpest turn that is planned.
double planned_radius(const VehicleConfig& vehicle, const PlannerConfig& config);

}  // namespace hybrid_slam
