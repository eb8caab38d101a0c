// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hybrid_slam/core/points.hpp"

namespace hybrid_slam {

struct Segment {
    Point2 start;
    Point2 end;
};

struct Circle {
    Point2 center;
    double radius = 0.0;  ///< metres
};

/// What a planar lidar can hit, and the path on which the robot is driven. Metres, frame `world`.
struct World {
    std::string name;
    std::vector<Segment> walls;
    std::vector<Circle> posts;
    std::vector<Point2> path;  ///< way points; a loop names its first point again at the end
    int laps = 1;              ///< how often the whole path is driven
    std::optional<double> start_heading;  ///< radians; without it towards the second way point

    /// Exact distance from `origin` along the unit vector `direction` to the nearest wall or post;
    /// infinity when nothing is hit.
    double cast_ray(const Point2& origin, const Eigen::Vector2d& direction) const;
};

/// Reads a world (see docs/formats.md). Throws Error with the file, the line and the key.
World read_world(const std::filesystem::path& file);

}  // namespace hybrid_slam
