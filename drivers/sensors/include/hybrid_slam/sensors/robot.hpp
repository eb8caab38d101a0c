// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "hybrid_slam/camera/camera_config.hpp"
#include "hybrid_slam/can/can_drive.hpp"
#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/lidar/lidar_config.hpp"
#include "hybrid_slam/vehicle/forklift.hpp"

namespace hybrid_slam {

/// Everything that is to be known of one vehicle: a file of config/robots.
struct RobotConfig {
    std::string name = "forklift";
    LidarConfig lidar;
    CameraConfig camera;
    VehicleConfig vehicle;
    CanDriveConfig can;
};

/// Keys name, lidar.*, camera.*, vehicle.*, can.*
void describe(ConfigSchema& schema, RobotConfig& robot);

/// Throws Error with the file, the line and the key.
RobotConfig read_robot(const std::filesystem::path& file);
std::string to_yaml(RobotConfig robot);

}  // namespace hybrid_slam
