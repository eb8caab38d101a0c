// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "hybrid_slam/calibration/extrinsics.hpp"

namespace hybrid_slam {

/// Poses of the camera, chained from the motions between images; broken where one is missing.
class CameraTrack {
  public:
    CameraTrack(const std::vector<VisualMotion>& vision, const Pose2d& robot_from_camera,
                double max_gap);

    /// How the camera moved between two stamps, and how fast it was at both.
    struct Motion {
        Pose2d begin_from_end;
        Eigen::Vector3d twist_at_begin;  ///< m/s, m/s, rad/s in its own axes
        Eigen::Vector3d twist_at_end;
    };
    /// Empty where both are not on one unbroken piece.
    std::optional<Motion> motion(double begin, double end) const;

  private:
    struct Node {
        double stamp = 0.0;
        Pose2d pose;  ///< piece_from_camera
        int piece = 0;
    };
    struct State {
        Node node;
        Eigen::Vector3d twist;
    };
    void append(const VisualMotion& motion, const Pose2d& camera_before_from_now, double max_gap);
    std::optional<Node> at(double stamp) const;
    std::optional<State> state(double stamp) const;

    std::vector<Node> nodes_;
};

/// The way of the laser between two scans.
struct LaserStep {
    double begin = 0.0;  ///< seconds
    double end = 0.0;
    Pose2d begin_from_end;
    /// Sum of the logarithms of the steps from scan to scan: what the twist integrates to in the
    /// laser's own axes (m, m, rad).
    Eigen::Vector3d integral = Eigen::Vector3d::Zero();
};

/// Steps of `length` seconds one after the other, without gaps of scans. They share their ends, so
/// that the error of one pose nearly cancels.
std::vector<LaserStep> laser_steps(const ExtrinsicsDrive& drive, double length, double max_gap);

/// Whether anything moved that is worth comparing.
bool moves(const LaserStep& step);

}  // namespace hybrid_slam
