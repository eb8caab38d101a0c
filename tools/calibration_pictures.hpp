// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "canvas.hpp"
#include "hybrid_slam/calibration/camera_calibration.hpp"
#include "hybrid_slam/calibration/ground_calibration.hpp"

namespace hybrid_slam::tools {

/// All corners of all photos in one image, with their errors drawn fifty times as long.
Canvas draw_board_fits(const BoardPhotos& photos, const CameraCalibration& result);

/// What is to be drawn of a ground calibration.
struct GroundPicture {
    const Image& image;
    const CameraModel& model;
    const std::vector<FloorPoint>& points;
    const GroundCalibration& ground;
    CameraMounting mounting;
};

/// The photo with the points as they were given and as the pose sees them, and lines on the floor:
/// ahead and across, half a metre apart, in the frame of the robot.
Canvas draw_ground(const GroundPicture& picture);

}  // namespace hybrid_slam::tools
