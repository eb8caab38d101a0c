// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <random>

#include "hybrid_slam/vehicle/clearance.hpp"
#include "hybrid_slam/vehicle/planner.hpp"

namespace hybrid_slam::test {

/// An empty room around the origin, its outermost cells walls.
inline StateGrid room(double length, double width, double resolution = 0.05) {
    StateGrid grid;
    grid.geometry = GridGeometry::around({-length / 2.0, -width / 2.0}, {length / 2.0, width / 2.0},
                                         resolution, 2.0 * resolution);
    grid.states.assign(static_cast<std::size_t>(grid.geometry.width) *
                           static_cast<std::size_t>(grid.geometry.height),
                       CellState::kFree);
    for (int y = 0; y < grid.geometry.height; ++y) {
        for (int x = 0; x < grid.geometry.width; ++x) {
            const Point2 middle = grid.geometry.center_of({x, y});
            if (std::abs(middle.x()) > length / 2.0 || std::abs(middle.y()) > width / 2.0) {
                grid.states[grid.geometry.index_of({x, y})] = CellState::kOccupied;
            }
        }
    }
    return grid;
}

/// Fills every cell of which the middle satisfies the condition.
template <typename Condition>
void fill(StateGrid& grid, CellState state, Condition&& condition) {
    for (int y = 0; y < grid.geometry.height; ++y) {
        for (int x = 0; x < grid.geometry.width; ++x) {
            if (condition(grid.geometry.center_of({x, y}))) {
                grid.states[grid.geometry.index_of({x, y})] = state;
            }
        }
    }
}

inline void add_box(StateGrid& grid, const Point2& center, const Point2& size,
                    CellState state = CellState::kOccupied) {
    fill(grid, state, [&](const Point2& point) {
        return std::abs(point.x() - center.x()) <= size.x() / 2.0 &&
               std::abs(point.y() - center.y()) <= size.y() / 2.0;
    });
}

/// config/worlds/thesis_hall.yaml.
inline StateGrid thesis_hall() {
    StateGrid grid = room(10.0, 7.2);
    add_box(grid, {-4.3, 3.1}, {1.4, 1.0});
    add_box(grid, {4.45, -3.25}, {1.1, 0.7});
    fill(grid, CellState::kOccupied, [](const Point2& point) {
        return (point - Point2(-4.4, -3.0)).norm() <= 0.4 || point.x() + point.y() > 7.5;
    });
    return grid;
}

/// config/worlds/warehouse.yaml, 50 x 30 m around its middle: aisles of 2.9 m, which the vehicle
/// cannot turn around in.
inline StateGrid warehouse() {
    StateGrid grid = room(50.0, 30.0);
    for (int row = 0; row < 6; ++row) {
        for (int pallet = 0; pallet < 7; ++pallet) {
            const double y = 5.0 + 4.0 * row - 15.0;
            add_box(grid, {5.3 + 2.7 * pallet - 25.0, y}, {2.5, 1.1});
            add_box(grid, {28.5 + 2.7 * pallet - 25.0, y}, {2.5, 1.1});
        }
    }
    return grid;
}

/// Metres from a point to a cell, seen from its edges.
inline double distance_to_cell(const GridGeometry& geometry, const Point2& point,
                               const Cell& cell) {
    const Point2 away = (point - geometry.center_of(cell)).cwiseAbs();
    const double half = geometry.resolution / 2.0;
    return std::hypot(std::max(0.0, away.x() - half), std::max(0.0, away.y() - half));
}

/// The plain meaning of a touching footprint: any blocked cell's square, or anything outside,
/// shares a point with the vehicle's rectangle grown by a margin. Separating axes.
inline bool touches(const StateGrid& grid, const VehicleConfig& vehicle, const Pose2d& pose,
                    double margin = 0.0) {
    const double front = vehicle.footprint_front + margin;
    const double rear = vehicle.footprint_rear + margin;
    const double half_width = vehicle.footprint_width / 2.0 + margin;
    const Point2 middle = pose * Point2((front - rear) / 2.0, 0.0);
    const double half_length = (front + rear) / 2.0;
    const double c = std::abs(std::cos(pose.heading));
    const double s = std::abs(std::sin(pose.heading));
    const double half = grid.geometry.resolution / 2.0;
    const double reach = half_length + half_width;
    const Cell low = grid.geometry.cell_of(middle - Point2(reach, reach));
    const Cell high = grid.geometry.cell_of(middle + Point2(reach, reach));
    for (int y = low.y; y <= high.y; ++y) {
        for (int x = low.x; x <= high.x; ++x) {
            if (grid.at({x, y}) == CellState::kFree) {
                continue;
            }
            const Point2 away = grid.geometry.center_of({x, y}) - middle;
            const Point2 seen = pose.rotation().transpose() * away;
            if (std::abs(away.x()) <= half_length * c + half_width * s + half &&
                std::abs(away.y()) <= half_length * s + half_width * c + half &&
                std::abs(seen.x()) <= half_length + half * (c + s) &&
                std::abs(seen.y()) <= half_width + half * (c + s)) {
                return true;
            }
        }
    }
    return false;
}

inline Waypoint at(double x, double y) {
    Waypoint waypoint;
    waypoint.position = {x, y};
    return waypoint;
}

inline Waypoint at(double x, double y, double heading) {
    Waypoint waypoint = at(x, y);
    waypoint.heading = heading;
    return waypoint;
}

inline Waypoint anywhere(const Pose2d& pose) {
    return at(pose.x(), pose.y());
}

/// Random poses of the vehicle at least half a metre clear of everything.
class Places {
  public:
    Places(const ClearanceField& field, const VehicleConfig& vehicle, unsigned seed)
        : field_(field), vehicle_(vehicle), random_(seed) {}

    Pose2d next() {
        const GridGeometry& geometry = field_.geometry();
        std::uniform_real_distribution<double> x(0.0, geometry.width * geometry.resolution);
        std::uniform_real_distribution<double> y(0.0, geometry.height * geometry.resolution);
        std::uniform_real_distribution<double> heading(-kPi, kPi);
        while (true) {
            Pose2d pose;
            pose.translation = geometry.origin + Point2(x(random_), 0.0);
            pose.translation.y() += y(random_);
            pose.heading = heading(random_);
            if (footprint_is_clear(field_, vehicle_, pose, 0.5)) {
                return pose;
            }
        }
    }

  private:
    const ClearanceField& field_;
    const VehicleConfig& vehicle_;
    std::mt19937 random_;
};

}  // namespace hybrid_slam::test
