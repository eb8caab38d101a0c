// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/occupancy_grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr double kMostCells = 268435456.0;      // 2^28
constexpr double kFarthestCell = 1073741824.0;  // 2^30, so that differences of indices fit an int

int cell_index(double coordinate) {
    const double cell = std::floor(coordinate);
    if (!(cell > -kFarthestCell)) {  // NaN too
        return static_cast<int>(-kFarthestCell);
    }
    return static_cast<int>(std::min(cell, kFarthestCell));
}

/// One axis of a ray, in cells. The parameter of the ray runs from 0 at its start to 1 at its end.
struct RayAxis {
    RayAxis(double from, double to, int from_cell, int to_cell)
        : cell(from_cell),
          step(to_cell >= from_cell ? 1 : -1),
          left(std::abs(to_cell - from_cell)),
          between_borders(step / (to - from)),
          first_border((from_cell + (step > 0 ? 1 : 0) - from) / (to - from)),
          next_border(first_border) {}

    void advance() {
        cell += step;
        --left;
        // From the count, not summed up: long rays collect no rounding.
        crossed += 1.0;
        next_border = first_border + crossed * between_borders;
    }

    int cell;
    int step;
    int left;  ///< borders still to cross
    double crossed = 0.0;
    double between_borders;
    double first_border;
    double next_border;  ///< the parameter at the next border
};

/// Amanatides and Woo, "A fast voxel traversal algorithm for ray tracing", 1987. The borders to
/// cross are counted beforehand, so that rounding at a corner can change the order of two steps,
/// but neither lead past the end nor leave a cell out.
template <typename Visitor>
void visit_ray(const GridGeometry& geometry, const Point2& from, const Point2& to,
               Visitor&& visit) {
    const Point2 a = (from - geometry.origin) / geometry.resolution;
    const Point2 b = (to - geometry.origin) / geometry.resolution;
    const Cell first = geometry.cell_of(from);
    const Cell last = geometry.cell_of(to);
    RayAxis x(a.x(), b.x(), first.x, last.x);
    RayAxis y(a.y(), b.y(), first.y, last.y);
    visit(first);
    while (x.left > 0 && y.left > 0) {
        // Not through a reference to either: that would keep both axes out of the registers.
        if (x.next_border < y.next_border) {
            x.advance();
        } else {
            y.advance();
        }
        visit(Cell{x.cell, y.cell});
    }
    RayAxis& rest = x.left > 0 ? x : y;
    while (rest.left > 0) {
        rest.advance();
        visit(Cell{x.cell, y.cell});
    }
}

double log_odds(double probability) {
    return std::log(probability / (1.0 - probability));
}

void check(const GridGeometry& geometry) {
    const double cells = static_cast<double>(geometry.width) * geometry.height;
    const bool good = geometry.resolution > 0.0 && std::isfinite(geometry.resolution) &&
                      geometry.origin.allFinite() && geometry.width >= 0 && geometry.height >= 0 &&
                      cells <= kMostCells;
    if (!good) {
        throw Error("occupancy grid: cannot have " + std::to_string(geometry.width) + " x " +
                    std::to_string(geometry.height) + " cells of " +
                    std::to_string(geometry.resolution) + " m");
    }
}

void check(const OccupancyGridConfig& config) {
    const bool ordered =
        0.0 < config.probability_min && config.probability_min <= config.probability_miss &&
        config.probability_miss < 0.5 && 0.5 < config.probability_hit &&
        config.probability_hit <= config.probability_max && config.probability_max < 1.0;
    if (!ordered) {
        throw Error(
            "occupancy grid: needs 0 < probability_min <= probability_miss < 0.5 < "
            "probability_hit <= probability_max < 1");
    }
    if (!(config.max_ray > 0.0)) {
        throw Error("occupancy grid: max_ray must be above 0");
    }
}

}  // namespace

Cell GridGeometry::cell_of(const Point2& point) const {
    return {cell_index((point.x() - origin.x()) / resolution),
            cell_index((point.y() - origin.y()) / resolution)};
}

Point2 GridGeometry::center_of(const Cell& cell) const {
    return origin + resolution * Point2(cell.x + 0.5, cell.y + 0.5);
}

GridGeometry GridGeometry::around(const Point2& lower, const Point2& upper, double resolution,
                                  double margin) {
    const Point2 low = (lower.cwiseMin(upper).array() - margin).matrix();
    const Point2 high = (lower.cwiseMax(upper).array() + margin).matrix();
    const Point2 size = (high - low) / resolution + Point2(1.0, 1.0);
    // cwiseMin hides a NaN, so the corners themselves are looked at.
    if (!(resolution > 0.0 && margin >= 0.0 && lower.allFinite() && upper.allFinite()) ||
        !(size.x() * size.y() <= kMostCells)) {
        throw Error("grid: an area of " + std::to_string(high.x() - low.x()) + " m x " +
                    std::to_string(high.y() - low.y()) + " m is too much for cells of " +
                    std::to_string(resolution) + " m");
    }
    GridGeometry geometry;
    geometry.resolution = resolution;
    geometry.origin = {std::floor(low.x() / resolution) * resolution,
                       std::floor(low.y() / resolution) * resolution};
    // Rounding may have put the origin past the corner by a hair.
    const Cell corner = geometry.cell_of(low);
    geometry.origin += resolution * Point2(std::min(corner.x, 0), std::min(corner.y, 0));
    const Cell last = geometry.cell_of(high);
    geometry.width = last.x + 1;
    geometry.height = last.y + 1;
    return geometry;
}

std::vector<Cell> walk_ray(const GridGeometry& geometry, const Point2& from, const Point2& to) {
    const Cell first = geometry.cell_of(from);
    const Cell last = geometry.cell_of(to);
    const double count = std::abs(static_cast<double>(last.x) - first.x) +
                         std::abs(static_cast<double>(last.y) - first.y) + 1.0;
    if (!from.allFinite() || !to.allFinite() || count > kMostCells) {
        throw Error("walk_ray: the ray is not finite or too long");
    }
    std::vector<Cell> cells;
    cells.reserve(static_cast<std::size_t>(count));
    visit_ray(geometry, from, to, [&cells](const Cell& cell) { cells.push_back(cell); });
    return cells;
}

OccupancyGrid::OccupancyGrid(const GridGeometry& geometry, const OccupancyGridConfig& config)
    : geometry_(geometry),
      max_ray_(config.max_ray),
      log_odds_hit_(static_cast<float>(log_odds(config.probability_hit))),
      log_odds_miss_(static_cast<float>(log_odds(config.probability_miss))),
      log_odds_min_(static_cast<float>(log_odds(config.probability_min))),
      log_odds_max_(static_cast<float>(log_odds(config.probability_max))) {
    check(geometry);
    check(config);
    beliefs_.resize(static_cast<std::size_t>(geometry.width) *
                    static_cast<std::size_t>(geometry.height));
}

// Inline by name, because position independent code may not inline an exported function by itself.
inline void OccupancyGrid::update(const Cell& cell, float log_odds_change) {
    if (!geometry_.contains(cell)) {
        return;
    }
    Belief& belief = beliefs_[geometry_.index_of(cell)];
    if (belief.last_scan != scan_count_) {
        belief.last_scan = scan_count_;
        belief.log_odds =
            std::clamp(belief.log_odds + log_odds_change, log_odds_min_, log_odds_max_);
    }
}

void OccupancyGrid::insert(const Point2& origin, const Points& ends) {
    if (!origin.allFinite()) {
        throw Error("occupancy grid: the origin of a scan is not finite");
    }
    ++scan_count_;
    // The ends first: then the walks that follow know which cells to leave alone.
    for (const Point2& end : ends) {
        if ((end - origin).norm() <= max_ray_) {  // NaN is not
            update(geometry_.cell_of(end), log_odds_hit_);
        }
    }
    for (const Point2& end : ends) {
        const double length = (end - origin).norm();
        if (!std::isfinite(length)) {
            continue;
        }
        const double share = length > max_ray_ ? max_ray_ / length : 1.0;
        visit_ray(geometry_, origin, origin + share * (end - origin),
                  [this](const Cell& cell) { update(cell, log_odds_miss_); });
    }
}

double OccupancyGrid::probability(const Cell& cell) const {
    if (!is_observed(cell)) {
        return 0.5;
    }
    return 1.0 /
           (1.0 + std::exp(-static_cast<double>(beliefs_[geometry_.index_of(cell)].log_odds)));
}

bool OccupancyGrid::is_observed(const Cell& cell) const {
    return geometry_.contains(cell) && beliefs_[geometry_.index_of(cell)].last_scan != 0;
}

StateGrid to_states(const OccupancyGrid& grid) {
    constexpr double kOccupiedAbove = 0.65;
    constexpr double kFreeBelow = 0.196;
    // Log odds are floats: a single hit of just the threshold must not pass it by rounding.
    constexpr double kRounding = 1e-6;
    StateGrid states;
    states.geometry = grid.geometry();
    states.states.reserve(static_cast<std::size_t>(states.geometry.width) *
                          static_cast<std::size_t>(states.geometry.height));
    for (int y = 0; y < states.geometry.height; ++y) {
        for (int x = 0; x < states.geometry.width; ++x) {
            const double probability = grid.probability({x, y});
            states.states.push_back(probability > kOccupiedAbove + kRounding ? CellState::kOccupied
                                    : probability < kFreeBelow - kRounding   ? CellState::kFree
                                                                             : CellState::kUnknown);
        }
    }
    return states;
}

}  // namespace hybrid_slam
