// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {

using Pixel = Eigen::Vector2d;  ///< (u, v), the centre of the first pixel is (0, 0)

/// A pinhole camera with the radial and tangential distortion of Brown, as OpenCV and ROS have it
/// (k1, k2, p1, p2, k3). The defaults are those of the thesis (Table 3.1). Frame `camera`: z
/// forward, x right, y down.
struct CameraModel {
    int width = 640;   ///< pixels
    int height = 480;  ///< pixels
    double fx = 731.318846;
    double fy = 708.229696;
    double cx = 354.491786;
    double cy = 235.166125;
    double k1 = -5.833e-3;
    double k2 = -8.3797e-2;
    double p1 = -3.210e-3;
    double p2 = 1.060e-3;
    double k3 = 0.0;

    /// Where a point appears; empty behind the camera. May lie outside of the image.
    std::optional<Pixel> project(const Eigen::Vector3d& point_in_camera) const;

    /// The point on the plane z = 1 that appears at the pixel: the distortion inverted by
    /// iteration. Empty where it cannot be (far outside of the image).
    std::optional<Eigen::Vector3d> ray(const Pixel& pixel) const;
};

/// Lists width, height, fx, ... without a section before them.
void describe(ConfigSchema& schema, CameraModel& model);

/// How the camera sits on the robot. With all angles zero it looks straight ahead and level.
struct CameraMounting {
    double x = 1.2;                ///< metres, ahead of the robot's origin
    double y = 0.0;                ///< metres, to the left
    double z = 1.0;                ///< metres above the floor
    double yaw = 0.0;              ///< radians, to the left
    double pitch = radians(15.0);  ///< radians, downwards
    double roll = 0.0;             ///< radians, clockwise as the camera looks

    Eigen::Isometry3d robot_from_camera() const;
};

/// Lists x, y, z, yaw_deg, pitch_deg and roll_deg.
void describe(ConfigSchema& schema, CameraMounting& mounting);

}  // namespace hybrid_slam
