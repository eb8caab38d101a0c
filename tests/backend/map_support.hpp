// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include "hybrid_slam/backend/map_folder.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam::test {

namespace fs = std::filesystem;

// Walls in the middle of cells of 5 cm, so that rounding moves no point into a neighbour.
inline constexpr double kHalfLength = 2.025;
inline constexpr double kHalfWidth = 1.525;

inline Point2 wall_seen(const Point2& from, double angle) {
    const Point2 direction(std::cos(angle), std::sin(angle));
    const double to_side = (std::copysign(kHalfLength, direction.x()) - from.x()) / direction.x();
    const double to_end = (std::copysign(kHalfWidth, direction.y()) - from.y()) / direction.y();
    return from + std::min(to_side, to_end) * direction;
}

inline Keyframe keyframe_at(const Pose2d& map_from_robot, int beams) {
    Keyframe keyframe;
    keyframe.robot_from_laser = {0.3, -0.1, 0.2};
    const Point2 laser = map_from_robot * keyframe.robot_from_laser.translation;
    for (int i = 0; i < beams; ++i) {
        const double angle = 0.001 + 2.0 * kPi * i / beams;
        keyframe.surface.points.push_back(map_from_robot.inverse() * wall_seen(laser, angle));
        keyframe.surface.normals.emplace_back(std::cos(angle), std::sin(angle));
    }
    keyframe.surface.normals.front().setZero();
    return keyframe;
}

inline Eigen::Matrix3d information() {
    Eigen::Matrix3d matrix;
    matrix << 400.0, 10.0, -3.0, 10.0, 300.0, 7.0, -3.0, 7.0, 2000.0 / 3.0;
    return matrix;
}

/// A drive through a room. Stamps run backwards once, as in real logs.
inline SlamMap room(int beams) {
    SlamMap map;
    for (int i = 0; i < 6; ++i) {
        const Pose2d map_from_robot(-1.0 + 0.4 * i, 0.1 * i - 0.3, normalize_angle(3.0 + 0.1 * i));
        Keyframe keyframe = keyframe_at(map_from_robot, beams);
        keyframe.stamp = i == 3 ? 100.0 : 101.0 + i / 3.0;
        keyframe.path = 0.42 * i;
        keyframe.local_from_robot = map_from_robot * Pose2d(0.01 * i, 0.0, 0.002 * i);
        map.graph.nodes.push_back(map_from_robot);
        map.trajectory.push_back({keyframe.stamp, map_from_robot});
        map.odometry_trajectory.push_back({keyframe.stamp, keyframe.local_from_robot});
        map.keyframes.push_back(std::move(keyframe));
    }
    for (std::size_t i = 1; i < 6; ++i) {
        map.graph.edges.push_back({i - 1, i, Pose2d(0.4, 0.1 / 3.0, 0.1), information()});
    }
    map.graph.edges.push_back({0, 5, Pose2d(2.0, 0.5, 0.5), information(), EdgeKind::kClosure});
    map.graph.priors.push_back({2, map.graph.nodes[2], information()});
    map.graph.fixed = {0};
    return map;
}

inline void store(const fs::path& folder, const SlamMap& map) {
    MapFolderWriter writer(folder);
    write_map(writer.path(), map);
    writer.commit();
}

/// Every file below a folder with its bytes, hidden ones too.
inline std::map<std::string, std::string> content_of(const fs::path& folder) {
    std::map<std::string, std::string> content;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        const std::string name = entry.path().lexically_relative(folder).string();
        content[name] = entry.is_directory() ? "a folder" : bytes_of(entry.path());
    }
    return content;
}

inline void overwrite(const fs::path& file, const std::string& bytes) {
    fs::remove(file);  // ext4 waits for the disk when a file is cut off and written anew
    std::ofstream(file, std::ios::binary) << bytes;
}

inline std::string flipped(std::string bytes, std::size_t at, unsigned bit) {
    bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ (1U << bit));
    return bytes;
}

/// CRC-32 bit by bit, as the oracle.
inline std::string slow_crc(const std::string& bytes) {
    std::uint32_t crc = 0xFFFFFFFFU;
    for (const char byte : bytes) {
        crc ^= static_cast<unsigned char>(byte);
        for (int bit = 0; bit < 8; ++bit) {
            crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
        }
    }
    return fmt::format("{:08x}", ~crc);
}

}  // namespace hybrid_slam::test
