// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hybrid_slam/calibration/chessboard.hpp"

namespace hybrid_slam {

struct CameraCalibrationConfig {
    bool same_focal_lengths = false;  ///< fx = fy, as with square pixels
    bool no_k3 = false;               ///< leaves k3 at zero: enough for ordinary lenses
    bool no_tangential = false;       ///< leaves p1 and p2 at zero
};

/// How well one photo agrees with the camera that was found.
struct BoardFit {
    std::size_t photo = 0;        ///< its place in BoardPhotos::photos()
    double rms = 0.0;             ///< pixels
    std::vector<Pixel> expected;  ///< where the camera would see the corners
};

/// Standard deviations of the parameters by the scatter of the corners; zero of what was fixed.
struct IntrinsicDeviations {
    double fx = 0.0;
    double fy = 0.0;
    double cx = 0.0;
    double cy = 0.0;
    double k1 = 0.0;
    double k2 = 0.0;
    double p1 = 0.0;
    double p2 = 0.0;
    double k3 = 0.0;
};

struct CameraCalibration {
    CameraModel model;
    IntrinsicDeviations deviations;
    double rms = 0.0;            ///< pixels, over all corners of all photos
    std::vector<BoardFit> fits;  ///< of the usable photos
    double coverage = 0.0;       ///< share of the image's 8 x 6 fields that hold a corner, 0 to 1
    double tilt_spread = 0.0;    ///< radians, the largest angle between two boards
    std::vector<std::string> warnings;  ///< what makes the result worse than its error tells
};

inline constexpr std::size_t kLeastBoards = 3;

/// Zhang's method, then all parameters over the reprojection error (OpenCV). Throws Error with
/// fewer than kLeastBoards usable photos and when they do not determine a camera.
CameraCalibration calibrate_camera(const BoardPhotos& photos,
                                   const CameraCalibrationConfig& config = {});

}  // namespace hybrid_slam
