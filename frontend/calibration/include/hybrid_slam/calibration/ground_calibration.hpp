// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "hybrid_slam/calibration/chessboard.hpp"
#include "hybrid_slam/core/camera_model.hpp"
#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {

/// The matrix H with `to` ~ H `from` (homogeneous): the direct linear transform by SVD of the
/// thesis's equations 3.3 to 3.5, with Hartley's normalisation; of unit norm. Throws Error for
/// fewer than four points and when they determine none (three of four on one line).
Eigen::Matrix3d fit_homography(const std::vector<Eigen::Vector2d>& from,
                               const std::vector<Eigen::Vector2d>& to);

/// A point of the floor and where it is seen.
struct FloorPoint {
    Pixel pixel;
    Eigen::Vector2d floor;  ///< metres, in the frame of the tile or board that was measured
};

/// The corners of a square tile, given in any order. Its frame: the origin in the middle, z up.
/// Throws Error when they are not four, or do not look like a tile.
std::vector<FloorPoint> tile_points(const CameraModel& model, const std::vector<Pixel>& corners,
                                    double side);

/// The inner corners of a board that lies on the floor; the origin in the middle of them, z up.
std::vector<FloorPoint> board_points(const std::vector<Pixel>& corners, const Chessboard& board);

/// The frame `patch` is that of the floor points, turned by quarters so that its x axis points away
/// from the camera as nearly as can be; y to the left, z up.
struct GroundCalibration {
    /// From the plane z = 1 of the undistorted camera to the floor, homogeneous.
    Eigen::Matrix3d patch_from_image = Eigen::Matrix3d::Identity();
    Eigen::Isometry3d patch_from_camera = Eigen::Isometry3d::Identity();
    /// In the frame of the patch, of which x, y and yaw say how the patch lies; z, pitch and roll
    /// are those of the camera on any robot.
    CameraMounting mounting;
    double rms = 0.0;             ///< pixels, of the points reprojected by the pose
    double homography_rms = 0.0;  ///< pixels, by the homography: zero with four points
    std::vector<Pixel> expected;  ///< where the pose would see the points
    /// Standard deviations when each coordinate of a pixel has one of a whole pixel.
    double height_per_pixel = 0.0;  ///< metres
    double pitch_per_pixel = 0.0;   ///< radians
    double roll_per_pixel = 0.0;    ///< radians

    /// The patch lies so nearly cornerwise that the choice of its x axis is a matter of chance.
    bool cornerwise() const;
};

/// The homography gives the pose, which is then refined over the reprojection error in the
/// distorted image. Throws Error when the points determine no floor below the camera.
GroundCalibration calibrate_ground(const CameraModel& model, const std::vector<FloorPoint>& points);

/// `before` with the height, pitch and roll that were found, and with all of it when it is known
/// where on the robot's floor the patch lay.
CameraMounting mounting_on_robot(const GroundCalibration& ground, const CameraMounting& before,
                                 const std::optional<Pose2d>& robot_from_patch);

/// The mounting whose robot_from_camera() is this pose.
CameraMounting mounting_of(const Eigen::Isometry3d& robot_from_camera);

}  // namespace hybrid_slam
