// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "hybrid_slam/backend/likelihood_pyramid.hpp"
#include "hybrid_slam/backend/slam.hpp"
#include "hybrid_slam/core/occupancy_grid.hpp"

namespace hybrid_slam {

/// The version of the folder's format that we write; all versions from 1 to this one can be read.
inline constexpr int kMapFormatVersion = 2;

/// Builds a map folder beside its final place and moves it there in one step, so that a crash, a
/// full disk or an interruption never leaves half a map or harms the one before.
///
///     MapFolderWriter writer("hall");
///     write_map(writer.path(), map, grid_config);  // and whatever else belongs beside it
///     writer.commit();
class MapFolderWriter {
  public:
    /// Creates the folders above it; clears what an earlier crash left. Throws Error when the place
    /// cannot be written, or holds something that is neither empty nor a map folder.
    explicit MapFolderWriter(const std::filesystem::path& folder);
    ~MapFolderWriter();  ///< without commit: removes what was written
    MapFolderWriter(const MapFolderWriter&) = delete;
    MapFolderWriter& operator=(const MapFolderWriter&) = delete;

    /// Where to write the files of the map; once committed, the map folder itself.
    const std::filesystem::path& path() const { return staging_; }

    /// Brings the manifest up to date (size and CRC-32 of every file), waits for the disk, and puts
    /// the folder into its place; a map that was there is replaced.
    /// Throws Error, and leaves the old map, when that fails or no map was written.
    void commit();

  private:
    struct Lock;

    std::filesystem::path folder_;
    std::filesystem::path staging_;
    std::unique_ptr<Lock> lock_;  ///< tells other writers that the staging folder is no leftover
    bool committed_ = false;
};

/// Writes into an existing folder: keyframes.bin, graph.g2o, trajectory.tum, odometry.tum,
/// map.yaml, map.pgm, points.ply, pyramid.bin (unless nothing was seen) and manifest.json. The same
/// map gives the same bytes. Throws Error for a map without keyframes or scans, or with another
/// number of keyframes than of nodes.
void write_map(const std::filesystem::path& folder, const SlamMap& map,
               const OccupancyGridConfig& grid_config = {});

/// What later sessions need of a map folder. The points of keyframes have the digits of a float,
/// and edges between successive keyframes are of kind kOdometry, all others kClosure.
struct StoredMap {
    int version = 0;
    Keyframes keyframes;
    PoseGraph graph;
    Trajectory trajectory;
    Trajectory odometry_trajectory;
    StateGrid grid;
    /// Of draw_walls, to search the map by; not in folders of version 1 and of a blind lidar.
    std::optional<LikelihoodPyramid> pyramid;
};

/// Reads a map folder. Throws Error in one line for a folder that is no map, a newer version, a
/// missing or damaged file (by size and CRC-32).
StoredMap read_map(const std::filesystem::path& folder);

/// The occupancy grid of keyframes at the poses of the graph, by ray casting. One stray pose must
/// not cost a map: where the area would take more than 2^25 cells, the resolution is doubled until
/// it does not. Throws Error when there are none, or another number than of nodes.
OccupancyGrid draw_grid(const Keyframes& keyframes, const PoseGraph& graph,
                        const OccupancyGridConfig& config = {});

/// The surfaces of all keyframes at the poses of the graph, one for each cell of `resolution`
/// metres and side of a wall: the mean of those in it, moved across the wall to where all that was
/// measured within 12 cm says that it is. Where no direction is known it is the mean alone. Normals
/// face the side that the wall was seen from.
Surface draw_surface(const Keyframes& keyframes, const PoseGraph& graph, double resolution);
/// The points of that.
Points draw_points(const Keyframes& keyframes, const PoseGraph& graph, double resolution);

/// What to localize against: the surface in steps of 5 cm, without what the grid of the same map
/// says has moved on, and without points of unknown direction beside walls.
Surface draw_walls(const Keyframes& keyframes, const PoseGraph& graph, const StateGrid& grid);

}  // namespace hybrid_slam
