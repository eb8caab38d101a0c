// SPDX-License-Identifier: Apache-2.0
#include "goal_distance.hpp"

#include <cmath>
#include <limits>
#include <queue>

namespace hybrid_slam {

GoalDistance::GoalDistance(const ClearanceField& field, const Point2& goal, double cell,
                           double disc)
    : grid_from_map_(field.grid_from_map()) {
    const GridGeometry& fine = field.geometry();
    geometry_.resolution = cell;
    geometry_.width = static_cast<int>(std::ceil(fine.width * fine.resolution / cell));
    geometry_.height = static_cast<int>(std::ceil(fine.height * fine.resolution / cell));
    const auto cells =
        static_cast<std::size_t>(geometry_.width) * static_cast<std::size_t>(geometry_.height);
    distances_.assign(cells, std::numeric_limits<float>::infinity());
    const Cell goal_cell = geometry_.cell_of(grid_from_map_ * goal);
    if (geometry_.contains(goal_cell)) {
        spread(goal_cell, passable_cells(field, disc));
    }
}

/// A cell counts as passable when the disc fits somewhere in it: the way must never be said to be
/// longer than it is.
std::vector<char> GoalDistance::passable_cells(const ClearanceField& field, double disc) const {
    const double slack =
        std::sqrt(0.5) * geometry_.resolution + std::sqrt(2.0) * field.geometry().resolution;
    const Pose2d map_from_grid = grid_from_map_.inverse();
    std::vector<char> passable(distances_.size());
    for (int y = 0; y < geometry_.height; ++y) {
        for (int x = 0; x < geometry_.width; ++x) {
            const Point2 middle = map_from_grid * geometry_.center_of({x, y});
            passable[geometry_.index_of({x, y})] =
                static_cast<char>(field.at(middle) + slack > disc);
        }
    }
    return passable;
}

void GoalDistance::spread(const Cell& goal, const std::vector<char>& passable) {
    using Entry = std::pair<float, std::size_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
    distances_[geometry_.index_of(goal)] = 0.0F;
    open.emplace(0.0F, geometry_.index_of(goal));
    const auto width = static_cast<std::size_t>(geometry_.width);
    while (!open.empty()) {
        const auto [distance, index] = open.top();
        open.pop();
        if (distance > distances_[index]) {
            continue;
        }
        const Cell cell{static_cast<int>(index % width), static_cast<int>(index / width)};
        for (int direction = 0; direction < 9; ++direction) {
            const Cell next{cell.x + direction % 3 - 1, cell.y + direction / 3 - 1};
            if (!geometry_.contains(next) || passable[geometry_.index_of(next)] == 0) {
                continue;
            }
            const double cells = std::hypot(next.x - cell.x, next.y - cell.y);
            const auto there = distance + static_cast<float>(cells * geometry_.resolution);
            float& known = distances_[geometry_.index_of(next)];
            if (there < known) {
                known = there;
                open.emplace(there, geometry_.index_of(next));
            }
        }
    }
}

double GoalDistance::at(const Point2& point) const {
    const Cell cell = geometry_.cell_of(grid_from_map_ * point);
    return geometry_.contains(cell) ? static_cast<double>(distances_[geometry_.index_of(cell)])
                                    : std::numeric_limits<double>::infinity();
}

}  // namespace hybrid_slam
