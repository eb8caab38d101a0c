// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "hybrid_slam/core/camera_model.hpp"

namespace hybrid_slam {

enum class CameraFormat {
    kRobot,   ///< our own: a robot file, or its section `camera` alone
    kOpenCv,  ///< what cv::FileStorage writes in calibrations
    kRos      ///< camera_info
};

/// What a file says of a camera.
struct CameraFile {
    CameraFormat format = CameraFormat::kRobot;
    CameraModel model;
    CameraMounting mounting;  ///< the defaults where the file says nothing
    bool has_model = false;
    bool has_mounting = false;
    /// Keys of our own format that say more than model and mounting, such as "lidar" and
    /// "camera.device"; what they say is not looked at.
    std::vector<std::string> other_keys;
};

/// Reads any of the formats, which tell themselves apart. Throws Error with file, line and key for
/// keys that a robot file does not have, missing or bad values, and cameras that CameraModel
/// cannot express (fisheye, rational polynomial).
CameraFile read_camera_file(const std::filesystem::path& file);

/// Part of a robot file: the section `camera` with model and mounting. Reads back to the bit.
std::string camera_yaml(CameraModel model, CameraMounting mounting);

}  // namespace hybrid_slam
