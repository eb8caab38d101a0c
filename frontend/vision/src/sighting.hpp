// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace hybrid_slam {

/// What is believed of how far away a feature is, as inverse depth along the optical axis.
struct DepthBelief {
    double inverse_depth = 0.0;  ///< 1/m
    double sigma = 0.0;          ///< 1/m

    /// Nothing at all: anything between a hand's breadth and infinity.
    static DepthBelief anywhere() { return {0.1, 5.0}; }
};

/// One feature seen in two images.
struct Sighting {
    Eigen::Vector2d before;       ///< on the plane z = 1 of the camera, distortion removed
    Eigen::Vector2d now;          ///< likewise
    Eigen::Matrix2d information;  ///< of `now`, on that plane
    DepthBelief belief;
    bool floor = false;  ///< the belief is that it lies on the floor

    // Found by the solver:
    bool on_floor = false;       ///< and moves like it
    double inverse_depth = 0.0;  ///< 1/m
    double chi2 = 0.0;           ///< with 2 degrees of freedom
    bool inlier = false;
};

}  // namespace hybrid_slam
