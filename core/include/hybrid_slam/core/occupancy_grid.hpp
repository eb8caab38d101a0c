// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "hybrid_slam/core/points.hpp"

namespace hybrid_slam {

/// Index of a cell: x to the right, y up, (0, 0) at the lower left.
struct Cell {
    int x = 0;
    int y = 0;
    bool operator==(const Cell& other) const { return x == other.x && y == other.y; }
};

/// Where a grid lies in its map and how large it is.
struct GridGeometry {
    double resolution = 0.05;  ///< metres per cell
    Point2 origin{0.0, 0.0};   ///< metres, of the lower left corner of cell (0, 0)
    int width = 0;             ///< cells
    int height = 0;            ///< cells

    Cell cell_of(const Point2& point) const;
    Point2 center_of(const Cell& cell) const;
    bool contains(const Cell& cell) const {
        return cell.x >= 0 && cell.y >= 0 && cell.x < width && cell.y < height;
    }
    std::size_t index_of(const Cell& cell) const {
        return static_cast<std::size_t>(cell.y) * static_cast<std::size_t>(width) +
               static_cast<std::size_t>(cell.x);
    }
    /// The smallest geometry on whole multiples of the resolution that holds both corners and a
    /// margin in metres around them. Throws Error when that would be more than 2^28 cells.
    static GridGeometry around(const Point2& lower, const Point2& upper, double resolution,
                               double margin);
};

/// The cells that a straight ray passes, from the one of `from` to the one of `to`, both included,
/// each once, neighbours sharing an edge (Amanatides and Woo 1987). Cells may lie outside of any
/// grid. Throws Error for ends that are not finite and rays of more than 2^28 cells.
std::vector<Cell> walk_ray(const GridGeometry& geometry, const Point2& from, const Point2& to);

enum class CellState : std::uint8_t { kFree, kOccupied, kUnknown };

struct OccupancyGridConfig {
    double resolution = 0.05;       ///< metres per cell
    double probability_hit = 0.65;  ///< of a cell in which a beam ends
    double probability_miss = 0.4;  ///< of a cell that a beam passes
    double probability_min = 0.02;  ///< clamping, so that a map can change its mind
    double probability_max = 0.98;
    double max_ray = 30.0;  ///< metres; longer beams free the way only up to here
};

/// Log odds of occupation, updated by ray casting.
class OccupancyGrid {
  public:
    /// The resolution is that of the geometry. Throws Error when the numbers make no sense.
    explicit OccupancyGrid(const GridGeometry& geometry, const OccupancyGridConfig& config = {});

    /// Frees the cells on the way from `origin` to each point and fills the one at its end. A scan
    /// changes a cell once, however many of its beams pass there (they are not independent), and a
    /// cell that any of them ends in is not freed. Points that are not finite are skipped.
    void insert(const Point2& origin, const Points& ends);

    const GridGeometry& geometry() const { return geometry_; }
    /// Probability of occupation; 0.5 where nothing was seen.
    double probability(const Cell& cell) const;
    bool is_observed(const Cell& cell) const;

  private:
    /// Together, so that a visit costs one cache line.
    struct Belief {
        float log_odds = 0.0F;
        std::uint32_t last_scan = 0;  ///< the scan that last changed it; 0 = never seen
    };

    void update(const Cell& cell, float log_odds_change);

    GridGeometry geometry_;
    double max_ray_ = 0.0;
    float log_odds_hit_ = 0.0F;
    float log_odds_miss_ = 0.0F;
    float log_odds_min_ = 0.0F;
    float log_odds_max_ = 0.0F;
    std::vector<Belief> beliefs_;
    std::uint32_t scan_count_ = 0;
};

/// A grid of three states, as map_server files hold it.
struct StateGrid {
    GridGeometry geometry;
    double origin_yaw = 0.0;        ///< radians; 0 in the maps that we write
    std::vector<CellState> states;  ///< row by row from the bottom

    CellState at(const Cell& cell) const {
        return geometry.contains(cell) ? states[geometry.index_of(cell)] : CellState::kUnknown;
    }
};

/// Thresholds as map_server: occupied above 0.65, free below 0.196.
StateGrid to_states(const OccupancyGrid& grid);

/// Writes `yaml_file` and beside it the PGM of the same stem (0 occupied, 205 unknown, 254 free;
/// free_thresh 0.196). Throws Error when a file cannot be written.
void write_map_server(const std::filesystem::path& yaml_file, const StateGrid& grid);

/// Reads `map.yaml` with its PGM (P5), written by us, ROS 1 or Nav2; mode scale is read as trinary,
/// raw is refused. Throws Error that names the file and what is wrong with it.
StateGrid read_map_server(const std::filesystem::path& yaml_file);

}  // namespace hybrid_slam
