// SPDX-License-Identifier: Apache-2.0
#include "grid_walls.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr std::array<Cell, 4> kDirections{{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};
constexpr int kTurns = 4;
constexpr double kStretch = 0.3;  ///< metres of border to each side that straighten it
constexpr int kLeastSteps = 3;    ///< cells, likewise
constexpr int kMostSteps = 30;
constexpr double kStraight = 0.45;  ///< cells RMS; the stairs of a slanted wall stay below
constexpr std::uint32_t kNoBorder = 0xFFFFFFFFU;

Cell operator+(const Cell& a, const Cell& b) {
    return {a.x + b.x, a.y + b.y};
}

Point2 vector_of(int direction) {
    const Cell& step = kDirections[static_cast<std::size_t>(direction)];
    return {static_cast<double>(step.x), static_cast<double>(step.y)};
}

/// The side of an occupied cell that looks to a free one.
struct Border {
    Cell cell;
    int direction = 0;  ///< of kDirections, to the free side
    std::uint32_t next = kNoBorder;
    std::uint32_t previous = kNoBorder;

    /// In cells; the middle of cell (0, 0) is the origin.
    Point2 middle() const { return Point2(cell.x, cell.y) + 0.5 * vector_of(direction); }
};

/// All borders of a grid, chained with the occupied side on the left.
class Borders {
  public:
    explicit Borders(const StateGrid& grid)
        : grid_(grid), index_(kTurns * grid.states.size(), kNoBorder) {
        for (int y = 0; y < grid.geometry.height; ++y) {
            for (int x = 0; x < grid.geometry.width; ++x) {
                for (int direction = 0; direction < kTurns; ++direction) {
                    add({x, y}, direction);
                }
            }
        }
        for (std::uint32_t i = 0; i < all_.size(); ++i) {
            all_[i].next = after(all_[i]);
            if (all_[i].next != kNoBorder) {
                all_[all_[i].next].previous = i;
            }
        }
    }

    const std::vector<Border>& all() const { return all_; }

  private:
    bool occupied(const Cell& cell) const { return grid_.at(cell) == CellState::kOccupied; }

    std::uint32_t& index_of(const Cell& cell, int direction) {
        return index_[kTurns * grid_.geometry.index_of(cell) + static_cast<std::size_t>(direction)];
    }

    void add(const Cell& cell, int direction) {
        const Cell beside = cell + kDirections[static_cast<std::size_t>(direction)];
        if (occupied(cell) && grid_.at(beside) == CellState::kFree) {
            index_of(cell, direction) = static_cast<std::uint32_t>(all_.size());
            all_.push_back({cell, direction});
        }
    }

    std::uint32_t after(const Border& border) {
        const int onward = (border.direction + 1) % kTurns;
        const Cell ahead = border.cell + kDirections[static_cast<std::size_t>(onward)];
        const Cell across = ahead + kDirections[static_cast<std::size_t>(border.direction)];
        if (occupied(across)) {
            return index_of(across, (border.direction + 3) % kTurns);
        }
        if (occupied(ahead)) {
            return index_of(ahead, border.direction);
        }
        return index_of(border.cell, onward);
    }

    const StateGrid& grid_;
    std::vector<std::uint32_t> index_;
    std::vector<Border> all_;
};

struct Line {
    Point2 point;
    Point2 normal;  ///< to the free side
    double rms = 0.0;
};

/// Least squares across the middles of a stretch of border.
Line line_through(const std::vector<Border>& all, const std::vector<std::uint32_t>& stretch) {
    Point2 mean = Point2::Zero();
    Point2 outward = Point2::Zero();
    for (const std::uint32_t i : stretch) {
        mean += all[i].middle();
        outward += vector_of(all[i].direction);
    }
    mean /= static_cast<double>(stretch.size());
    Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
    for (const std::uint32_t i : stretch) {
        const Point2 away = all[i].middle() - mean;
        scatter += away * away.transpose() / static_cast<double>(stretch.size());
    }
    const double along = 0.5 * std::atan2(2.0 * scatter(0, 1), scatter(0, 0) - scatter(1, 1));
    Point2 normal(-std::sin(along), std::cos(along));
    if (normal.dot(outward) < 0.0) {
        normal = -normal;
    }
    return {mean, normal, std::sqrt(std::max(normal.dot(scatter * normal), 0.0))};
}

/// The border and its neighbours, so many before and after it.
std::vector<std::uint32_t> stretch_around(const std::vector<Border>& all, std::uint32_t from,
                                          int before, int after) {
    std::vector<std::uint32_t> stretch{from};
    std::uint32_t at = from;
    for (int i = 0; i < after && all[at].next != kNoBorder && all[at].next != from; ++i) {
        at = all[at].next;
        stretch.push_back(at);
    }
    const std::uint32_t last = at;
    at = from;
    for (int i = 0; i < before && all[at].previous != kNoBorder && all[at].previous != last; ++i) {
        at = all[at].previous;
        stretch.push_back(at);
    }
    return stretch;
}

/// Where the wall runs at a border: through both its neighbourhoods, or at a corner through the one
/// on its own side of it; else as the cell's side lies.
Line wall_at(const std::vector<Border>& all, std::uint32_t i, int steps) {
    const Line both = line_through(all, stretch_around(all, i, steps, steps));
    if (both.rms <= kStraight) {
        return both;
    }
    const Line before = line_through(all, stretch_around(all, i, steps, 0));
    const Line after = line_through(all, stretch_around(all, i, 0, steps));
    const Line& better = before.rms < after.rms ? before : after;
    if (better.rms <= kStraight) {
        return better;
    }
    return {all[i].middle(), vector_of(all[i].direction), 0.0};
}

void expect_states(const StateGrid& grid) {
    const GridGeometry& geometry = grid.geometry;
    if (geometry.width < 1 || geometry.height < 1 || !(geometry.resolution > 0.0) ||
        grid.states.size() !=
            static_cast<std::size_t>(geometry.width) * static_cast<std::size_t>(geometry.height)) {
        throw Error("the grid has no cells, or another number than its size says");
    }
}

Pose2d map_from_grid(const StateGrid& grid) {
    return {grid.geometry.origin, grid.origin_yaw};
}

/// With another grid's eyes: its cell (0, 0) at the origin, no yaw.
CellState state_at(const StateGrid& grid, const Point2& point_in_grid) {
    const Point2 cell = point_in_grid / grid.geometry.resolution;
    return grid.at(
        {static_cast<int>(std::floor(cell.x())), static_cast<int>(std::floor(cell.y()))});
}

CellState resampled(const StateGrid& grid, const Pose2d& grid_from_map, const Point2& center) {
    const double quarter = 0.25 * grid.geometry.resolution;
    for (const double dx : {-quarter, quarter}) {
        for (const double dy : {-quarter, quarter}) {
            if (state_at(grid, grid_from_map * (center + Point2(dx, dy))) == CellState::kOccupied) {
                return CellState::kOccupied;
            }
        }
    }
    return state_at(grid, grid_from_map * center);
}

}  // namespace

Surface walls_of(const StateGrid& grid) {
    expect_states(grid);
    const double resolution = grid.geometry.resolution;
    const int steps = static_cast<int>(
        std::clamp<double>(std::round(kStretch / resolution), kLeastSteps, kMostSteps));
    const Borders borders(grid);
    Surface walls;
    for (std::uint32_t i = 0; i < borders.all().size(); ++i) {
        const Line line = wall_at(borders.all(), i, steps);
        const Point2 middle = borders.all()[i].middle();
        // Cells that a line passes reach this far over it, on the mean of its stairs.
        const double inside = 0.5 * line.normal.lpNorm<1>();
        const Point2 on_line = middle + (line.point - middle).dot(line.normal) * line.normal;
        walls.points.push_back(resolution *
                               (on_line - inside * line.normal + Point2::Constant(0.5)));
        walls.normals.push_back(line.normal);
    }
    if (walls.points.empty()) {
        throw Error("no occupied cell of the grid is beside a free one, so the map has no walls");
    }
    return transform(map_from_grid(grid), walls);
}

StateGrid turned_upright(const StateGrid& grid) {
    if (grid.origin_yaw == 0.0) {
        return grid;
    }
    expect_states(grid);
    const double resolution = grid.geometry.resolution;
    const Point2 size = resolution * Point2(grid.geometry.width, grid.geometry.height);
    const Points corners =
        transform(map_from_grid(grid), Points{{0.0, 0.0}, {size.x(), 0.0}, size, {0.0, size.y()}});
    Point2 lower = corners.front();
    Point2 upper = lower;
    for (const Point2& corner : corners) {
        lower = lower.cwiseMin(corner);
        upper = upper.cwiseMax(corner);
    }
    StateGrid upright;
    upright.geometry = GridGeometry::around(lower, upper, resolution, 0.0);
    const Pose2d grid_from_map = map_from_grid(grid).inverse();
    for (int y = 0; y < upright.geometry.height; ++y) {
        for (int x = 0; x < upright.geometry.width; ++x) {
            upright.states.push_back(
                resampled(grid, grid_from_map, upright.geometry.center_of({x, y})));
        }
    }
    return upright;
}

}  // namespace hybrid_slam
