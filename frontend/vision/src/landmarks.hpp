// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "camera_on_robot.hpp"
#include "feature_tracker.hpp"
#include "floor_border.hpp"
#include "hybrid_slam/vision/floor_mask.hpp"
#include "sighting.hpp"

namespace hybrid_slam {

/// A feature of a key image, to be followed.
struct Landmark {
    cv::Point2f pixel;                                  ///< in the key image
    Eigen::Vector2d ray = Eigen::Vector2d::Zero();      ///< see Sighting::before
    Eigen::Matrix2d texture = Eigen::Matrix2d::Zero();  ///< 1 / pixel^2, see textures_of
    DepthBelief belief;
    bool floor = false;          ///< the belief is that it lies on the floor
    cv::Point2f now;             ///< in the newest image
    double inverse_depth = 0.0;  ///< 1/m, as found last

    /// `to`; but on an edge only what of the way there leads across it: a point slides along an
    /// edge as it likes, and would end where that runs another way.
    cv::Point2f across(const cv::Point2f& from, const cv::Point2f& to) const;
};

/// What tells floor from the rest in one image; any of it may be missing.
struct FloorHints {
    const FloorBorder* border = nullptr;
    const FloorMask* mask = nullptr;
};

/// Where the features at these pixels are believed to be. On the floor: below the foot of the
/// nearest obstacle of their column, and where the mask says so. On what stands there: above it.
/// What shows no texture, or where nothing can be, is left out. `pixel_sigma`: see textures_of.
std::vector<Landmark> make_landmarks(const Pyramid& pyramid, const ImagePoints& points,
                                     const CameraOnRobot& camera, const FloorHints& hints,
                                     double pixel_sigma);

}  // namespace hybrid_slam
