// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "camera_on_robot.hpp"
#include "sighting.hpp"

namespace hybrid_slam {

/// What is believed before looking at the sightings.
struct SightBelief {
    Pose2d before_from_now;
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  ///< of its (x, y, heading)
    double tilt_sigma = radians(0.02);                      ///< radians, of pitch and of roll
    /// Of how the camera looks past where its mounting says: (pitch, yaw), 1/rad2.
    Eigen::Matrix2d aim_information = Eigen::Matrix2d::Zero();
};

/// How the robot moved between two images.
struct SolvedMotion {
    Pose2d before_from_now;
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  ///< by the sightings alone
    Eigen::Vector2d tilt = Eigen::Vector2d::Zero();  ///< radians, about the camera's x and z axes
    Eigen::Vector2d aim = Eigen::Vector2d::Zero();   ///< radians, pitch and yaw of the mounting off
    Eigen::Matrix2d aim_information = Eigen::Matrix2d::Zero();  ///< by the sightings alone
    std::size_t inliers = 0;
    std::size_t floor_inliers = 0;
};

/// Where a direction of the image before shows on the plane z = 1 of the image now, and how that
/// changes.
struct Prediction {
    Eigen::Vector2d now = Eigen::Vector2d::Zero();
    /// Derivatives by x, y, heading, and tilt about the camera's x and z.
    Eigen::Matrix<double, 2, 5> by_motion = Eigen::Matrix<double, 2, 5>::Zero();
    Eigen::Vector2d by_inverse_depth = Eigen::Vector2d::Zero();
    bool ahead = false;  ///< of the camera
};
Prediction predict(const CameraOnRobot& camera, const Eigen::Vector3d& before, double inverse_depth,
                   const Pose2d& before_from_now, const Eigen::Vector2d& tilt);

/// Heading, translation, a small tilt of the camera and how its mounting is off by all sightings
/// together, each with its own doubt about its depth, robustly: iteratively reweighted least
/// squares whose kernel narrows. What the sightings leave open follows the belief. A sighting that
/// is believed to lie on the floor but does not move like it counts as one of unknown depth.
SolvedMotion solve_motion(const CameraOnRobot& camera, std::vector<Sighting>& sightings,
                          const SightBelief& belief);

}  // namespace hybrid_slam
