// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "figure.hpp"
#include "hybrid_slam/backend/loop_closing.hpp"
#include "hybrid_slam/backend/pose_graph.hpp"
#include "hybrid_slam/core/trajectory.hpp"

namespace hybrid_slam::tools {

/// The grid with the way on top, coloured from start to end.
struct MapPicture {
    std::string title;
    std::string subtitle;
    const StateGrid& grid;
    const Trajectory& trajectory;
    Trajectory earlier;  ///< of the map that this drive went onto; may be empty
};
Canvas draw(const MapPicture& picture);

using NodePair = std::pair<std::size_t, std::size_t>;

/// A graph before and after it was solved, side by side.
struct GraphPicture {
    std::string title;
    std::string before_caption;
    std::string after_caption;
    std::vector<Pose2d> before;
    std::vector<Pose2d> after;
    std::vector<NodePair> odometry;
    std::vector<NodePair> accepted;
    std::vector<NodePair> refused;
    std::vector<NodePair> waiting;
};
Canvas draw(const GraphPicture& picture);
/// Sorts closures by their verdicts into the picture.
void add_closures(GraphPicture& picture, const std::vector<Closure>& closures);
void add_edges(GraphPicture& picture, const PoseGraph& graph);

/// One of several ways over a map.
struct DrawnPath {
    std::string name;
    Color color;
    Trajectory trajectory;
};

/// All ways that were found over one map, each in its colour, their ends marked.
struct PathsPicture {
    std::string title;
    std::string subtitle;
    Points points;                 ///< of the map
    Trajectory truth;              ///< dashed; may be empty
    std::vector<DrawnPath> paths;  ///< the last on top
};
/// Those that lead far away from the map and the truth are cut off, and the legend says so.
Canvas draw(const PathsPicture& picture);

/// What one way to run the pipeline made of a log.
struct VariantPicture {
    std::string caption;
    Points points;  ///< of the map
    Trajectory trajectory;
};
/// Side by side in one scale. The bounds are those of the last, widened for the others within
/// reason.
Canvas draw_comparison(const std::string& title, const std::string& subtitle,
                       const std::vector<VariantPicture>& variants);

}  // namespace hybrid_slam::tools
