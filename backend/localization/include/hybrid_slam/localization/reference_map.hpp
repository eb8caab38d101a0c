// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "hybrid_slam/backend/likelihood_pyramid.hpp"
#include "hybrid_slam/backend/map_folder.hpp"
#include "hybrid_slam/core/occupancy_grid.hpp"
#include "hybrid_slam/registration/surface.hpp"

namespace hybrid_slam {

/// A map to localize in: never changed while driving. All coordinates are in the frame of the map.
class ReferenceMap {
  public:
    /// Throws Error for a map without walls.
    ReferenceMap(Surface surface, StateGrid grid, LikelihoodPyramid pyramid,
                 double wall_sigma = 0.0);

    /// The walls, with normals that face the side they were seen from.
    const Surface& surface() const { return reference_.surface(); }
    const Reference& reference() const { return reference_; }
    const StateGrid& grid() const { return grid_; }
    const LikelihoodPyramid& pyramid() const { return pyramid_; }

    /// Metres by which whole walls may be off because of how the map was stored: 0 for one of
    /// scans.
    double wall_sigma() const { return wall_sigma_; }
    /// What that does to a heading, in radians: between walls that are some metres apart.
    double heading_sigma() const { return wall_sigma_ / 4.0; }

    static constexpr std::uint32_t kNothing = 0xFFFFFFFFU;
    /// Index into surface() of the point nearest to the middle of a cell of its own table at
    /// `point`, or kNothing where there is none within kNear (within a cell, where the map is so
    /// large that these are coarser). Made once, so that it costs one look.
    std::uint32_t nearest(const Point2& point) const;
    static constexpr double kNear = 0.3;  ///< metres

  private:
    Reference reference_;
    StateGrid grid_;
    LikelihoodPyramid pyramid_;
    GridGeometry near_geometry_;
    std::vector<std::uint32_t> nearest_;
    double wall_sigma_;
};

/// Of a map folder read by read_map. The pyramid is the stored one when the folder has one (format
/// version 2), else built now.
std::shared_ptr<const ReferenceMap> reference_of(const StoredMap& map);

/// Of the occupied cells of a grid that others made: their borders to free space become walls, each
/// of which may lie anywhere in its cells.
std::shared_ptr<const ReferenceMap> reference_of(const StateGrid& grid);

/// Whether a path names a map_server map (.yaml or .yml) rather than a map folder.
bool is_map_server_file(const std::filesystem::path& path);

/// Reads a map folder, or a map_server map when `path` is the file of one. Throws Error as the
/// readers of both do.
std::shared_ptr<const ReferenceMap> read_reference_map(const std::filesystem::path& path);

}  // namespace hybrid_slam
