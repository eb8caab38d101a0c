// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vehicle/surroundings.hpp"

#include <algorithm>
#include <cmath>

namespace hybrid_slam {
namespace {

constexpr double kCell = 0.05;     ///< metres, of what is remembered
constexpr double kHidden = 0.15;   ///< metres behind a return from which a place is hidden by it
constexpr double kMapReach = 3.0;  ///< metres around the robot in which the map is looked at

/// The whole plane in cells; map coordinates are far below 2^30 of these.
std::int64_t key_of(const Point2& point) {
    const auto x = static_cast<std::int64_t>(std::floor(point.x() / kCell));
    const auto y = static_cast<std::int64_t>(std::floor(point.y() / kCell));
    return x * (std::int64_t{1} << 32) + y;
}

Point2 middle_of(std::int64_t key) {
    constexpr std::int64_t kHalf = std::int64_t{1} << 31;
    constexpr std::int64_t kWhole = std::int64_t{1} << 32;
    const std::int64_t y = ((key + kHalf) % kWhole + kWhole) % kWhole - kHalf;
    const std::int64_t x = (key - y) / kWhole;
    return kCell * Point2(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
}

}  // namespace

void describe(ConfigSchema& schema, SurroundingsConfig& config) {
    schema.add("reach", config.reach, 0.5, 30.0, "m around the robot; farther on nobody looks");
    schema.add("remember", config.remember, 0.0, 3600.0,
               "s that what went out of the scanner's sight is kept");
    schema.add("margin", config.margin, 0.0, 1.0,
               "m to each side of the vehicle that must be free as well");
    schema.add("trust_blind_area", config.trust_blind_area,
               "whether to go where neither the scanner sees nor anything was seen");
}

/// False, too, for what hides behind something nearer.
bool Surroundings::looks_at(const Point2& in_robot) const {
    const Point2 seen = scan_.robot_from_laser.inverse() * in_robot;
    const double distance = seen.norm();
    const double beam =
        std::round((std::atan2(seen.y(), seen.x()) - scan_.angle_min) / scan_.angle_increment);
    if (!(beam >= 0.0 && beam < static_cast<double>(scan_.ranges.size())) ||
        distance < scan_.range_min) {
        return false;
    }
    const float range = scan_.ranges[static_cast<std::size_t>(beam)];
    // NaN: a sector that the vehicle itself hides.
    // Nor does something that lies over the scanner: nearer than it measures.
    return range >= scan_.range_max || (scan_.is_return(range) && distance <= range + kHidden);
}

void Surroundings::see(const Scan& scan, const Pose2d& map_from_robot) {
    scan_ = scan;
    map_from_robot_ = map_from_robot;
    returns_.clear();
    for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
        if (scan.is_return(scan.ranges[i])) {
            const double angle = scan.angle(i);
            const Point2 in_robot =
                scan.robot_from_laser * (scan.ranges[i] * Point2(std::cos(angle), std::sin(angle)));
            if (in_robot.norm() <= config_.reach) {
                returns_.push_back(in_robot);
            }
        }
    }
    drop_what_is_seen();
    remember_returns();
}

void Surroundings::drop_what_is_seen() {
    const Pose2d robot_from_map = map_from_robot_.inverse();
    for (auto each = memory_.begin(); each != memory_.end();) {
        const Point2 in_robot = robot_from_map * middle_of(each->first);
        const bool is_old = !(scan_.stamp - each->second <= config_.remember);
        const bool drop = is_old || in_robot.norm() > config_.reach || looks_at(in_robot);
        each = drop ? memory_.erase(each) : std::next(each);
    }
}

void Surroundings::remember_returns() {
    for (const Point2& in_robot : returns_) {
        memory_[key_of(map_from_robot_ * in_robot)] = scan_.stamp;
    }
}

void Surroundings::correct(const Pose2d& new_map_from_old_map) {
    std::unordered_map<std::int64_t, double> moved;
    for (const auto& [key, stamp] : memory_) {
        double& newest =
            moved.try_emplace(key_of(new_map_from_old_map * middle_of(key)), stamp).first->second;
        newest = std::max(newest, stamp);
    }
    memory_ = std::move(moved);
    map_from_robot_ = new_map_from_old_map * map_from_robot_;
}

bool Surroundings::sees_behind(const VehicleConfig& vehicle) const {
    constexpr double kNear = 0.3;  // metres
    bool all = !scan_.ranges.empty();
    for (const double side : {-0.5, 0.0, 0.5}) {
        all = all && looks_at({-vehicle.footprint_rear - kNear, side * vehicle.footprint_width});
    }
    return all;
}

Points Surroundings::obstacles() const {
    Points points = returns_;
    const Pose2d robot_from_map = map_from_robot_.inverse();
    for (const auto& [key, stamp] : memory_) {
        const Point2 in_robot = robot_from_map * middle_of(key);
        if (stamp < scan_.stamp && !looks_at(in_robot)) {
            points.push_back(in_robot);
        }
    }
    return points;
}

Points Surroundings::obstacles(const StateGrid& map) const {
    Points points = obstacles();
    const GridGeometry& grid = map.geometry;
    const double reach = std::min(kMapReach, config_.reach);
    const Pose2d map_from_grid(grid.origin, map.origin_yaw);
    const Pose2d robot_from_grid = map_from_robot_.inverse() * map_from_grid;
    const Point2 robot = grid.origin + robot_from_grid.inverse().translation;
    const Cell low = grid.cell_of(robot - Eigen::Vector2d(reach, reach));
    const Cell high = grid.cell_of(robot + Eigen::Vector2d(reach, reach));
    for (int y = std::max(low.y, 0); y <= std::min(high.y, grid.height - 1); ++y) {
        for (int x = std::max(low.x, 0); x <= std::min(high.x, grid.width - 1); ++x) {
            const Cell cell{x, y};
            if (map.states[grid.index_of(cell)] != CellState::kOccupied) {
                continue;
            }
            const Point2 in_robot = robot_from_grid * (grid.center_of(cell) - grid.origin);
            if (!looks_at(in_robot)) {
                points.push_back(in_robot);
            }
        }
    }
    return points;
}

}  // namespace hybrid_slam
