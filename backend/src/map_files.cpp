// SPDX-License-Identifier: Apache-2.0
#include "map_files.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "byte_codec.hpp"
#include "hybrid_slam/backend/g2o.hpp"
#include "hybrid_slam/backend/map_folder.hpp"
#include "hybrid_slam/backend/point_cloud.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam {
namespace {

constexpr std::string_view kMagic = "HSKEYFRM";
constexpr std::uint32_t kKeyframesVersion = 1;
constexpr std::size_t kKeyframeBytes = 8 * sizeof(double) + sizeof(std::uint32_t);
constexpr std::size_t kPointBytes = 4 * sizeof(float);  // with its normal
constexpr double kMargin = 0.5;                         ///< metres of unknown around what was seen
constexpr double kMostCells = 1 << 25;

Keyframe read_keyframe(ByteReader& reader) {
    Keyframe keyframe;
    keyframe.stamp = reader.real();
    keyframe.path = reader.real();
    keyframe.local_from_robot = reader.pose();
    keyframe.robot_from_laser = reader.pose();
    const std::size_t points = reader.count(kPointBytes);
    keyframe.surface.points = reader.points(points);
    keyframe.surface.normals = reader.points(points);
    return keyframe;
}

struct Bounds {
    void include(const Point2& point) {
        if (point.allFinite()) {
            lower = lower.cwiseMin(point);
            upper = upper.cwiseMax(point);
        }
    }
    Point2 lower{INFINITY, INFINITY};
    Point2 upper{-INFINITY, -INFINITY};
};

/// Of everything seen and of the way: not empty even when the lidar was blind.
Bounds bounds_of(const Keyframes& keyframes, const PoseGraph& graph) {
    expect_keyframe_per_node(keyframes, graph);
    if (keyframes.empty()) {
        throw Error("map: there is no keyframe to draw");
    }
    Bounds bounds;
    for (std::size_t i = 0; i < keyframes.size(); ++i) {
        const Pose2d& map_from_robot = graph.nodes[i];
        bounds.include(map_from_robot.translation);
        bounds.include(map_from_robot * keyframes[i].robot_from_laser.translation);
        for (const Point2& point : transform(map_from_robot, keyframes[i].surface.points)) {
            bounds.include(point);
        }
    }
    return bounds;
}

}  // namespace

void expect_keyframe_per_node(const Keyframes& keyframes, const PoseGraph& graph) {
    if (keyframes.size() != graph.nodes.size()) {
        throw Error(fmt::format("map: {} keyframes do not go with a graph of {} nodes",
                                keyframes.size(), graph.nodes.size()));
    }
}

void write_keyframes(const std::filesystem::path& file, const Keyframes& keyframes) {
    ByteWriter out(file.string());
    out.put_text(kMagic);
    out.put_count(kKeyframesVersion);
    out.put_count(keyframes.size());
    for (const Keyframe& keyframe : keyframes) {
        const Surface& surface = keyframe.surface;
        if (surface.normals.size() != surface.points.size()) {
            throw Error(fmt::format("{}: a keyframe has {} points but {} normals", file.string(),
                                    surface.points.size(), surface.normals.size()));
        }
        out.put_double(keyframe.stamp);
        out.put_double(keyframe.path);
        out.put_pose(keyframe.local_from_robot);
        out.put_pose(keyframe.robot_from_laser);
        out.put_count(surface.size());
        out.put_floats(surface.points);
        out.put_floats(surface.normals);
    }
    TextFileWriter writer(file);
    writer.write(out.bytes());
    writer.close();
}

Keyframes read_keyframes(const std::filesystem::path& file) {
    ByteReader reader(file);
    reader.expect_head(kMagic, kKeyframesVersion, "keyframes");
    Keyframes keyframes(reader.count(kKeyframeBytes));
    for (Keyframe& keyframe : keyframes) {
        keyframe = read_keyframe(reader);
    }
    reader.expect_end();
    return keyframes;
}

OccupancyGrid draw_grid(const Keyframes& keyframes, const PoseGraph& graph,
                        const OccupancyGridConfig& config) {
    const Bounds bounds = bounds_of(keyframes, graph);
    OccupancyGridConfig affordable = config;
    const Point2 extent = bounds.upper - bounds.lower + Point2::Constant(2.0 * kMargin);
    while (extent.x() * extent.y() > kMostCells * affordable.resolution * affordable.resolution) {
        affordable.resolution *= 2.0;
    }
    OccupancyGrid grid(
        GridGeometry::around(bounds.lower, bounds.upper, affordable.resolution, kMargin),
        affordable);
    for (std::size_t i = 0; i < keyframes.size(); ++i) {
        const Pose2d& map_from_robot = graph.nodes[i];
        grid.insert(map_from_robot * keyframes[i].robot_from_laser.translation,
                    transform(map_from_robot, keyframes[i].surface.points));
    }
    return grid;
}

void write_map(const std::filesystem::path& folder, const SlamMap& map,
               const OccupancyGridConfig& grid_config) {
    const Bounds bounds = bounds_of(map.keyframes, map.graph);
    if (map.trajectory.empty()) {
        throw Error("map: there is no trajectory to write");
    }
    write_keyframes(folder / "keyframes.bin", map.keyframes);
    write_g2o(folder / "graph.g2o", map.graph);
    write_tum(folder / "trajectory.tum", map.trajectory);
    write_tum(folder / "odometry.tum", map.odometry_trajectory);
    const StateGrid grid = to_states(draw_grid(map.keyframes, map.graph, grid_config));
    write_map_server(folder / "map.yaml", grid);
    if (const Surface walls = draw_walls(map.keyframes, map.graph, grid); walls.size() > 0) {
        write_pyramid(folder / kPyramidName, search_pyramid(walls.points));
    }
    write_ply(folder / "points.ply", draw_points(map.keyframes, map.graph, grid_config.resolution));
    write_manifest(folder, {{"counts",
                             {{"keyframes", map.keyframes.size()},
                              {"edges", map.graph.edges.size()},
                              {"scans", map.trajectory.size()}}},
                            {"bounds",
                             {{"lower", {bounds.lower.x(), bounds.lower.y()}},
                              {"upper", {bounds.upper.x(), bounds.upper.y()}}}}});
}

}  // namespace hybrid_slam
