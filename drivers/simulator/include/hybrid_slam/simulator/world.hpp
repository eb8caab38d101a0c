// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
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

/// Somebody who walks to and fro along a polyline, seen as a post.
struct Person {
    Points way;           ///< two points or more
    double speed = 1.0;   ///< m/s
    double radius = 0.2;  ///< metres

    /// Where the person is `time` seconds after the start, at the first point then.
    Circle at(double time) const;
};

/// What a planar lidar can hit, and the path on which the robot is driven. Metres, frame `world`.
struct World {
    std::string name;
    std::vector<Segment> walls;
    std::vector<Circle> posts;
    std::vector<Point2> path;  ///< way points; a loop names its first point again at the end
    std::map<std::string, Points> paths;  ///< others by their names
    int laps = 1;                         ///< how often the whole path is driven
    std::vector<Person> people;
    std::optional<double> start_heading;  ///< radians; without it towards the second way point

    /// The path of that name; `path` for an empty one. Throws Error that lists the names.
    const Points& path_named(const std::string& path_name) const;

    /// Where everybody is at a time.
    std::vector<Circle> people_at(double time) const;

    /// Exact distance from `origin` along the unit vector `direction` to the nearest wall or post;
    /// infinity when nothing is hit. Those who walk are left out.
    double cast_ray(const Point2& origin, const Eigen::Vector2d& direction) const;
};

/// Reads a world (see docs/formats.md). Throws Error with the file, the line and the key.
World read_world(const std::filesystem::path& file);

}  // namespace hybrid_slam
