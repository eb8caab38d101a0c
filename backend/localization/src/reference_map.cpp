// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/localization/reference_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "grid_walls.hpp"
#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr double kNearResolution = 0.05;  ///< metres
constexpr double kMostCells = 1 << 25;

Surface expect_walls(Surface surface) {
    if (surface.points.empty() || surface.normals.size() != surface.points.size()) {
        throw Error("the map has no walls to localize by");
    }
    return surface;
}

/// One of another map would find places that are none.
const LikelihoodPyramid& expect_holds(const LikelihoodPyramid& pyramid, const Surface& walls) {
    const auto is_likely = [&pyramid](const Point2& point) {
        const Cell cell = pyramid.geometry().cell_of(point);
        return pyramid.at(0, cell.x, cell.y) > 0;
    };
    if (!std::all_of(walls.points.begin(), walls.points.end(), is_likely)) {
        throw Error("the stored pyramid is not that of the map's walls");
    }
    return pyramid;
}

/// Coarser where a stray point would make the table absurdly large.
GridGeometry geometry_around(const Points& points) {
    Point2 lower = points.front();
    Point2 upper = lower;
    for (const Point2& point : points) {
        lower = lower.cwiseMin(point);
        upper = upper.cwiseMax(point);
    }
    const Point2 extent = upper - lower + Point2::Constant(2.0 * ReferenceMap::kNear);
    double resolution = kNearResolution;
    while (extent.x() * extent.y() > kMostCells * resolution * resolution) {
        resolution *= 2.0;
    }
    return GridGeometry::around(lower, upper, resolution, ReferenceMap::kNear);
}

/// Each point writes itself into the cells around it for which it is the nearest so far.
class Stamper {
  public:
    explicit Stamper(const GridGeometry& geometry)
        : geometry_(geometry),
          // In cells coarser than usual a point must still reach the middle of its own.
          reach_(std::max(ReferenceMap::kNear, geometry.resolution)),
          nearest_(
              static_cast<std::size_t>(geometry.width) * static_cast<std::size_t>(geometry.height),
              ReferenceMap::kNothing),
          squared_(nearest_.size(), reach_ * reach_) {}

    void stamp(const Point2& point, std::uint32_t index) {
        const Cell first = geometry_.cell_of(point - Point2::Constant(reach_));
        const Cell last = geometry_.cell_of(point + Point2::Constant(reach_));
        for (int y = std::max(first.y, 0); y <= std::min(last.y, geometry_.height - 1); ++y) {
            for (int x = std::max(first.x, 0); x <= std::min(last.x, geometry_.width - 1); ++x) {
                const double squared = (geometry_.center_of({x, y}) - point).squaredNorm();
                const std::size_t at = geometry_.index_of({x, y});
                if (squared < squared_[at]) {
                    squared_[at] = squared;
                    nearest_[at] = index;
                }
            }
        }
    }

    std::vector<std::uint32_t> take() { return std::move(nearest_); }

  private:
    const GridGeometry& geometry_;
    double reach_;
    std::vector<std::uint32_t> nearest_;
    std::vector<double> squared_;
};

}  // namespace

ReferenceMap::ReferenceMap(Surface surface, StateGrid grid, LikelihoodPyramid pyramid,
                           double wall_sigma)
    : reference_(expect_walls(std::move(surface))),
      grid_(std::move(grid)),
      pyramid_(std::move(pyramid)),
      near_geometry_(geometry_around(reference_.surface().points)),
      wall_sigma_(wall_sigma) {
    Stamper stamper(near_geometry_);
    const Points& points = reference_.surface().points;
    for (std::size_t i = 0; i < points.size(); ++i) {
        stamper.stamp(points[i], static_cast<std::uint32_t>(i));
    }
    nearest_ = stamper.take();
}

std::uint32_t ReferenceMap::nearest(const Point2& point) const {
    const Cell cell = near_geometry_.cell_of(point);
    return near_geometry_.contains(cell) ? nearest_[near_geometry_.index_of(cell)] : kNothing;
}

std::shared_ptr<const ReferenceMap> reference_of(const StoredMap& map) {
    Surface walls = expect_walls(draw_walls(map.keyframes, map.graph, map.grid));
    LikelihoodPyramid pyramid =
        map.pyramid ? expect_holds(*map.pyramid, walls) : search_pyramid(walls.points);
    return std::make_shared<const ReferenceMap>(std::move(walls), map.grid, std::move(pyramid));
}

std::shared_ptr<const ReferenceMap> reference_of(const StateGrid& grid) {
    Surface walls = walls_of(grid);
    LikelihoodPyramid pyramid = search_pyramid(walls.points);
    // Evenly spread over a cell.
    const double wall_sigma = grid.geometry.resolution / std::sqrt(12.0);
    return std::make_shared<const ReferenceMap>(std::move(walls), turned_upright(grid),
                                                std::move(pyramid), wall_sigma);
}

bool is_map_server_file(const std::filesystem::path& path) {
    const std::filesystem::path suffix = path.extension();
    return (suffix == ".yaml" || suffix == ".yml") && !std::filesystem::is_directory(path);
}

namespace {

/// The readers name the file; what is wrong with the map as a whole does not.
template <typename Map>
std::shared_ptr<const ReferenceMap> reference_in(const std::filesystem::path& path,
                                                 const Map& map) {
    try {
        return reference_of(map);
    } catch (const Error& error) {
        throw Error(path.string() + ": " + error.what());
    }
}

}  // namespace

std::shared_ptr<const ReferenceMap> read_reference_map(const std::filesystem::path& path) {
    if (is_map_server_file(path)) {
        return reference_in(path, read_map_server(path));
    }
    return reference_in(path, read_map(path));
}

}  // namespace hybrid_slam
