// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>

#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam::tools {

/// Where a vehicle was when it was last sure of it, for the next start.
struct LastPose {
    std::string map;           ///< as it was named
    std::string map_identity;  ///< see map_identity.hpp
    double stamp = 0.0;        ///< seconds, of the scan
    Pose2d map_from_robot;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< axes of the map: m2, m rad, rad2
    double score = 0.0;                                    ///< 0 to 1
};

/// Atomic. Throws Error when the file cannot be written.
void write_last_pose(const std::filesystem::path& file, const LastPose& last);

/// Throws Error that names the file for all that is no such file.
LastPose read_last_pose(const std::filesystem::path& file);

}  // namespace hybrid_slam::tools
