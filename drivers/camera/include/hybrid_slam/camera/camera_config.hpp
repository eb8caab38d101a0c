// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hybrid_slam/core/camera_model.hpp"
#include "hybrid_slam/core/config.hpp"

namespace hybrid_slam {

/// A camera: where its images come from, its optics and how it sits on the robot.
struct CameraConfig {
    bool enabled = true;
    /// A V4L2 device, http://[user:password@]host[:port]/path of a network camera (MJPEG), a video
    /// file or a folder of images.
    std::string device = "/dev/video0";
    double rate = 30.0;        ///< images per second, asked of the device; the pace of files
    double latency = 0.03;     ///< seconds from the middle of the exposure to the arrival
    double stall_after = 1.0;  ///< seconds without an image after which the camera counts as lost
    CameraModel model;
    CameraMounting mounting;
};

/// Lists the keys without a section before them; model.* and mounting.* are sections within.
void describe(ConfigSchema& schema, CameraConfig& config);

}  // namespace hybrid_slam
