// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "hybrid_slam/core/frame.hpp"
#include "hybrid_slam/core/trajectory.hpp"
#include "hybrid_slam/registration/surface.hpp"
#include "hybrid_slam/simulator/world.hpp"

/// Rooms with exact walls, and scans of them whose truth is known.
namespace hybrid_slam::test {

using Rng = std::mt19937;

inline double gauss(Rng& rng, double sigma) {
    return std::normal_distribution<double>(0.0, sigma)(rng);
}
inline double uniform(Rng& rng, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(rng);
}

inline void add_outline(World& world, const Points& corners) {
    for (std::size_t i = 0; i < corners.size(); ++i) {
        world.walls.push_back({corners[i], corners[(i + 1) % corners.size()]});
    }
}
inline void add_box(World& world, const Pose2d& world_from_box, double length, double width) {
    const double x = 0.5 * length;
    const double y = 0.5 * width;
    add_outline(world, transform(world_from_box, Points{{-x, -y}, {x, -y}, {x, y}, {-x, y}}));
}

/// About 10 x 8 m; no two of its walls are parallel by accident, so that one pose alone fits a
/// scan.
inline World irregular_room() {
    World world;
    world.name = "irregular room";
    add_outline(world, {{-5.0, -3.6},
                        {4.0, -4.0},
                        {5.2, -1.0},
                        {4.6, 3.0},
                        {1.0, 3.3},
                        {0.8, 4.4},
                        {-2.0, 4.1},
                        {-4.6, 2.4}});
    add_box(world, {-3.4, -2.4, 0.5}, 1.0, 0.6);
    world.posts.push_back({{3.0, 1.5}, 0.3});
    return world;
}

/// Two walls at y = -1 and y = 1 without any end in sight.
inline World endless_corridor() {
    World world;
    world.name = "corridor";
    world.walls.push_back({{-1000.0, -1.0}, {1000.0, -1.0}});
    world.walls.push_back({{-1000.0, 1.0}, {1000.0, 1.0}});
    return world;
}

/// A hall of 24 x 16 m around a block in its middle, driven around twice: about 56 m a lap.
inline World ring_hall() {
    World world;
    world.name = "ring hall";
    add_outline(world, {{0, 0},
                        {9, 0},
                        {9, -1},
                        {11, -1},
                        {11, 0},
                        {24, 0},
                        {24, 10},
                        {23, 10},
                        {23, 12},
                        {24, 12},
                        {24, 16},
                        {7, 16},
                        {7, 15},
                        {4, 15},
                        {4, 16},
                        {0, 16}});
    add_outline(world,
                {{5, 5}, {13, 5}, {13, 4.2}, {15, 4.2}, {15, 5}, {19, 5}, {19, 11}, {5, 11}});
    add_box(world, {0.8, 9.0, 0.2}, 1.0, 2.0);
    add_box(world, {21.5, 0.8, 0.0}, 2.0, 0.8);
    add_box(world, {14.0, 15.3, 0.1}, 2.5, 0.9);
    world.posts.push_back({{17.0, 1.2}, 0.25});
    world.posts.push_back({{4.4, 4.4}, 0.2});
    world.path = {{2.5, 2.5}, {21.5, 2.5}, {21.5, 13.4}, {2.5, 13.4}, {2.5, 2.5}};
    world.laps = 2;
    return world;
}

/// Distance of a point to the nearest wall or post, in metres.
inline double distance_to(const World& world, const Point2& point) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Segment& wall : world.walls) {
        const Eigen::Vector2d along = wall.end - wall.start;
        const double at =
            std::clamp((point - wall.start).dot(along) / along.squaredNorm(), 0.0, 1.0);
        nearest = std::min(nearest, (point - wall.start - at * along).norm());
    }
    for (const Circle& post : world.posts) {
        nearest = std::min(nearest, std::abs((point - post.center).norm() - post.radius));
    }
    return nearest;
}

struct Lidar {
    int beams = 360;
    double field_of_view = 2.0 * kPi;  ///< radians, centred ahead
    double range_max = 30.0;           ///< metres
    double sigma = 0.0;                ///< metres
    double time_increment = 0.0;       ///< seconds between beams
    Pose2d robot_from_laser;
};

/// The scan from `world_from_robot`. With a twist (robot's axes) and a time increment the robot
/// drives on while the beams are taken. `rng` is drawn from only for noise.
inline Scan scan_at(const World& world, const Pose2d& world_from_robot, const Lidar& lidar,
                    Rng& rng, const Eigen::Vector3d& twist = Eigen::Vector3d::Zero()) {
    Scan scan;
    scan.angle_increment = lidar.field_of_view / lidar.beams;
    scan.angle_min = -0.5 * lidar.field_of_view;
    scan.range_min = 0.02;
    scan.range_max = lidar.range_max;
    scan.time_increment = lidar.time_increment;
    scan.robot_from_laser = lidar.robot_from_laser;
    for (int beam = 0; beam < lidar.beams; ++beam) {
        const Pose2d world_from_laser = world_from_robot *
                                        Pose2d::exp(beam * lidar.time_increment * twist) *
                                        lidar.robot_from_laser;
        const double angle = world_from_laser.heading + scan.angle(static_cast<std::size_t>(beam));
        double range =
            world.cast_ray(world_from_laser.translation, {std::cos(angle), std::sin(angle)});
        if (lidar.sigma > 0.0) {
            range += gauss(rng, lidar.sigma);
        }
        scan.ranges.push_back(static_cast<float>(range));
    }
    return scan;
}

inline Scan scan_at(const World& world, const Pose2d& world_from_robot, const Lidar& lidar = {}) {
    Rng unused;
    Lidar exact = lidar;
    exact.sigma = 0.0;
    return scan_at(world, world_from_robot, exact, unused);
}

/// A scan in which no beam came back.
inline Scan blind_scan() {
    Scan scan;
    scan.ranges.assign(360, std::numeric_limits<float>::infinity());
    scan.angle_increment = 2.0 * kPi / 360.0;
    scan.angle_min = -kPi;
    scan.range_max = 30.0;
    return scan;
}

/// The returns in the robot's frame, unfiltered, with normals.
inline Surface surface_of(const Scan& scan) {
    Points points;
    for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
        if (scan.is_return(scan.ranges[i])) {
            const double range = scan.ranges[i];
            points.push_back(scan.robot_from_laser * Point2(range * std::cos(scan.angle(i)),
                                                            range * std::sin(scan.angle(i))));
        }
    }
    return with_normals(std::move(points), scan.robot_from_laser.translation);
}

/// Frames of a drive along `truth`, with wheel odometry that is the truth seen from the first pose.
inline std::vector<Frame> frames_along(const World& world, const Trajectory& truth,
                                       const Lidar& lidar, unsigned seed) {
    Rng rng(seed);
    std::vector<Frame> frames;
    for (const StampedPose& pose : truth) {
        Frame frame;
        frame.scan = scan_at(world, pose.pose, lidar, rng);
        frame.scan.stamp = pose.stamp;
        frame.odom_from_robot = between(truth.front().pose, pose.pose);
        frames.push_back(std::move(frame));
    }
    return frames;
}

/// Once around an ellipse in the middle of the irregular room, ten scans a second, nose ahead.
inline Trajectory ellipse_lap(int scans, double radius_x = 2.2, double radius_y = 1.4) {
    Trajectory lap;
    for (int i = 0; i < scans; ++i) {
        const double angle = 2.0 * kPi * i / scans;
        const double heading = std::atan2(radius_y * std::cos(angle), -radius_x * std::sin(angle));
        lap.push_back({0.1 * i, {radius_x * std::cos(angle), radius_y * std::sin(angle), heading}});
    }
    return lap;
}

/// Distance and angle between two poses, the larger of metres and radians.
inline double apart(const Pose2d& a, const Pose2d& b) {
    const Pose2d difference = between(a, b);
    return std::max(difference.translation.norm(), std::abs(difference.heading));
}

}  // namespace hybrid_slam::test
