// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "hybrid_slam/backend/map_folder.hpp"
#include "hybrid_slam/core/error.hpp"
#include "map_files.hpp"

namespace hybrid_slam {
namespace {

constexpr double kReach = 0.12;     ///< metres: what this near says where a wall is
constexpr double kSameSide = 0.8;   ///< cosine between the normals of one wall
constexpr double kFarthest = 1e15;  ///< cells; well inside of what 64 bits count

struct CellKey {
    std::int64_t x;
    std::int64_t y;
    int face;  ///< quadrant that it looks to; the two faces of a thin wall stay apart
    bool operator==(const CellKey& other) const {
        return x == other.x && y == other.y && face == other.face;
    }
};

struct CellHash {
    std::size_t operator()(const CellKey& key) const {
        constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15U;  // 2^64 / golden ratio
        const std::uint64_t mixed = static_cast<std::uint64_t>(key.x) * kGolden;
        const auto rest = static_cast<std::uint64_t>(5 * key.y + key.face);
        return ((mixed ^ (mixed >> 32U)) + rest) * kGolden;
    }
};

constexpr int kFaces = 5;

/// Turned by 45 degrees, so that walls along the axes do not flicker between two.
int face_of(const Point2& normal) {
    if (normal.isZero(0.0)) {
        return kFaces - 1;
    }
    return (normal.y() + normal.x() >= 0.0 ? 1 : 0) + (normal.y() - normal.x() >= 0.0 ? 2 : 0);
}

/// Sums of the points that fell into one cell.
struct Bin {
    CellKey key{};
    Point2 sum = Point2::Zero();
    Point2 normal_sum = Point2::Zero();
    double count = 0.0;

    Point2 mean() const { return sum / count; }
    Point2 normal() const { return normal_sum.isZero(0.0) ? normal_sum : normal_sum.normalized(); }
};

class Bins {
  public:
    explicit Bins(double resolution) : resolution_(resolution) {}

    void add(const Point2& point, const Point2& normal, double count) {
        const Eigen::Array2d cell = (point.array() / resolution_).floor();
        if (!(cell.abs() < kFarthest).all()) {  // NaN is not
            return;
        }
        const CellKey key{static_cast<std::int64_t>(cell.x()), static_cast<std::int64_t>(cell.y()),
                          face_of(normal)};
        const auto [found, is_new] = index_of_.emplace(key, bins_.size());
        if (is_new) {
            bins_.emplace_back();
            bins_.back().key = key;
        }
        Bin& bin = bins_[found->second];
        bin.sum += count * point;
        bin.normal_sum += count * normal;
        bin.count += count;
    }

    const std::vector<Bin>& bins() const { return bins_; }

    /// Where the wall of a bin is, by all bins near it that face the same way: a step of moving
    /// least squares along the normal.
    Point2 on_wall(const Bin& bin) const {
        const Point2 mean = bin.mean();
        const Point2 normal = bin.normal();
        if (normal.isZero(0.0)) {
            return mean;
        }
        const auto reach = static_cast<std::int64_t>(std::ceil(kReach / resolution_));
        const std::int64_t cells = std::min<std::int64_t>(reach, 12);  // of a very fine resolution
        double offset = 0.0;
        double count = 0.0;
        for (std::int64_t dx = -cells; dx <= cells; ++dx) {
            for (std::int64_t dy = -cells; dy <= cells; ++dy) {
                for (int face = 0; face + 1 < kFaces; ++face) {
                    const auto found = index_of_.find({bin.key.x + dx, bin.key.y + dy, face});
                    if (found == index_of_.end()) {
                        continue;
                    }
                    const Bin& other = bins_[found->second];
                    const Point2 away = other.mean() - mean;
                    if (away.norm() <= kReach && other.normal().dot(normal) >= kSameSide) {
                        offset += other.count * away.dot(normal);
                        count += other.count;
                    }
                }
            }
        }
        return mean + offset / count * normal;  // it counts itself
    }

  private:
    double resolution_;
    std::unordered_map<CellKey, std::size_t, CellHash> index_of_;
    std::vector<Bin> bins_;  ///< in the order of their first points
};

constexpr double kWallResolution = 0.05;  ///< metres between the points of a wall
constexpr double kLoneResolution = 0.15;  ///< metres; lone points this near to a wall are of it

CellKey wall_cell(const Point2& point) {
    const Eigen::Array2d cell = (point.array() / kLoneResolution).floor();
    return {static_cast<std::int64_t>(cell.x()), static_cast<std::int64_t>(cell.y()), 0};
}

bool is_beside(const std::unordered_set<CellKey, CellHash>& walls, const Point2& point) {
    const CellKey middle = wall_cell(point);
    for (int i = 0; i < 9; ++i) {
        if (walls.count({middle.x + i % 3 - 1, middle.y + i / 3 - 1, 0}) > 0) {
            return true;
        }
    }
    return false;
}

/// Free all around: what was there once has moved on.
bool is_seen_through(const StateGrid& grid, const Point2& point) {
    const Cell middle = grid.geometry.cell_of(point);
    for (int i = 0; i < 9; ++i) {
        if (grid.at({middle.x + i % 3 - 1, middle.y + i / 3 - 1}) != CellState::kFree) {
            return false;
        }
    }
    return true;
}

}  // namespace

Surface draw_surface(const Keyframes& keyframes, const PoseGraph& graph, double resolution) {
    expect_keyframe_per_node(keyframes, graph);
    if (!(resolution > 0.0)) {
        throw Error(fmt::format("map: points cannot be drawn in cells of {} m", resolution));
    }
    Bins measured(resolution);
    for (std::size_t i = 0; i < keyframes.size(); ++i) {
        const Surface surface = transform(graph.nodes[i], keyframes[i].surface);
        for (std::size_t j = 0; j < surface.size(); ++j) {
            measured.add(surface.points[j], surface.normals[j], 1.0);
        }
    }
    Bins sharpened(resolution);
    for (const Bin& bin : measured.bins()) {
        sharpened.add(measured.on_wall(bin), bin.normal(), bin.count);
    }
    Surface surface;
    surface.points.reserve(sharpened.bins().size());
    surface.normals.reserve(sharpened.bins().size());
    for (const Bin& bin : sharpened.bins()) {
        surface.points.push_back(bin.mean());
        surface.normals.push_back(bin.normal());
    }
    return surface;
}

Points draw_points(const Keyframes& keyframes, const PoseGraph& graph, double resolution) {
    return draw_surface(keyframes, graph, resolution).points;
}

Surface draw_walls(const Keyframes& keyframes, const PoseGraph& graph, const StateGrid& grid) {
    const Surface drawn = draw_surface(keyframes, graph, kWallResolution);
    std::unordered_set<CellKey, CellHash> oriented_cells;
    for (std::size_t i = 0; i < drawn.size(); ++i) {
        if (!drawn.normals[i].isZero(0.0)) {
            oriented_cells.insert(wall_cell(drawn.points[i]));
        }
    }
    Surface walls;
    for (std::size_t i = 0; i < drawn.size(); ++i) {
        const bool lone = drawn.normals[i].isZero(0.0);
        if (is_seen_through(grid, drawn.points[i]) ||
            (lone && is_beside(oriented_cells, drawn.points[i]))) {
            continue;
        }
        walls.points.push_back(drawn.points[i]);
        walls.normals.push_back(drawn.normals[i]);
    }
    return walls;
}

}  // namespace hybrid_slam
