// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "hybrid_slam/core/camera_model.hpp"

namespace hybrid_slam {

/// The camera's geometry, worked out once. Directions and points are in the robot's frame.
class CameraOnRobot {
  public:
    CameraOnRobot(const CameraModel& model, const CameraMounting& mounting)
        : model_(model),
          mounting_(mounting),
          robot_from_camera_(mounting.robot_from_camera()),
          camera_from_robot_(robot_from_camera_.inverse()) {}

    /// The same camera with its pitch and yaw (radians) changed.
    CameraOnRobot turned_by(const Eigen::Vector2d& pitch_and_yaw) const {
        CameraMounting mounting = mounting_;
        mounting.pitch += pitch_and_yaw.x();
        mounting.yaw += pitch_and_yaw.y();
        return {model_, mounting};
    }

    const CameraModel& model() const { return model_; }
    double focal_length() const { return 0.5 * (model_.fx + model_.fy); }
    Eigen::Vector3d center() const { return robot_from_camera_.translation(); }
    Eigen::Matrix3d robot_from_camera() const { return robot_from_camera_.linear(); }

    /// Through a place on the plane z = 1 of the camera, and as long.
    Eigen::Vector3d direction(const Eigen::Vector2d& ray) const {
        return robot_from_camera_.linear() * ray.homogeneous();
    }

    /// Inverse depth (along the optical axis) at which a direction meets the floor; not positive
    /// when it does not.
    double floor_inverse_depth(const Eigen::Vector3d& direction) const {
        return -direction.z() / center().z();
    }

    /// Where a point shows; empty behind the camera.
    std::optional<Pixel> project(const Eigen::Vector3d& point) const {
        return model_.project(camera_from_robot_ * point);
    }

  private:
    CameraModel model_;
    CameraMounting mounting_;
    Eigen::Isometry3d robot_from_camera_;
    Eigen::Isometry3d camera_from_robot_;
};

}  // namespace hybrid_slam
