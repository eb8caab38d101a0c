// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "hybrid_slam/core/frame.hpp"
#include "hybrid_slam/core/trajectory.hpp"
#include "hybrid_slam/localization/reference_map.hpp"
#include "hybrid_slam/localization/scan_fit.hpp"
#include "hybrid_slam/odometry/scan_filter.hpp"
#include "hybrid_slam/simulator/simulator.hpp"
#include "hybrid_slam/simulator/world.hpp"
#include "support/s300_scan.hpp"

namespace hybrid_slam::test {

inline World world_named(const std::string& name) {
    return read_world(std::string(HYBRID_SLAM_SOURCE_DIR "/config/worlds/") + name + ".yaml");
}

inline Sweep sweep_of(const Scan& scan) {
    return {scan.robot_from_laser.translation, to_surface(scan, ScanFilterConfig())};
}

/// A map of a world as if made by a perfect SLAM: keyframes exactly at `poses` (world_from_robot),
/// with noisy scans. The map's frame is the world.
inline StoredMap stored_map_of(const World& world, const std::vector<Pose2d>& poses,
                               double sigma = 0.02, unsigned seed = 1) {
    std::mt19937 random(seed);
    StoredMap map;
    for (const Pose2d& pose : poses) {
        const Scan scan = scan_at(world, pose, random, sigma);
        map.keyframes.push_back({static_cast<double>(map.keyframes.size()),
                                 0.0,
                                 pose,
                                 {},
                                 to_surface(scan, ScanFilterConfig())});
        map.graph.nodes.push_back(pose);
        map.trajectory.push_back({map.keyframes.back().stamp, pose});
    }
    map.grid = to_states(draw_grid(map.keyframes, map.graph));
    return map;
}

/// Poses along the world's path, every `step` metres, to and fro.
inline std::vector<Pose2d> poses_along(const World& world, double step = 0.4) {
    std::vector<Pose2d> poses;
    for (std::size_t i = 1; i < world.path.size(); ++i) {
        const Point2 way = world.path[i] - world.path[i - 1];
        const double heading = std::atan2(way.y(), way.x());
        for (double at = 0.0; at < way.norm(); at += step) {
            const Point2 place = world.path[i - 1] + at / way.norm() * way;
            poses.emplace_back(place, heading);
            poses.emplace_back(place, normalize_angle(heading + kPi));
        }
    }
    return poses;
}

inline std::shared_ptr<const ReferenceMap> map_of(const World& world, double sigma = 0.02) {
    return reference_of(stored_map_of(world, poses_along(world), sigma));
}

/// Frames of a drive along the world's path with wheel odometry, and the true poses at the scans.
struct TestDrive {
    std::vector<Frame> frames;
    Trajectory truth;  ///< world_from_robot
};

inline TestDrive drive_in(const World& world, const SimulatorConfig& config) {
    Simulator simulator(world, config);
    FrameAssembler assembler;
    TestDrive drive;
    while (auto measurement = simulator.next()) {
        if (auto frame = assembler.push(std::move(*measurement))) {
            drive.frames.push_back(std::move(*frame));
        }
    }
    drive.truth = simulator.truth();
    return drive;
}

/// As a S300 would see it: 270 degrees, sigma 2 cm.
inline SimulatorConfig s300_config(double speed = 0.3, int seed = 1) {
    SimulatorConfig config;
    config.speed = speed;
    config.field_of_view = radians(270.0);
    config.angle_increment = radians(0.5);
    config.range_sigma = 0.02;
    config.seed = seed;
    return config;
}

}  // namespace hybrid_slam::test
