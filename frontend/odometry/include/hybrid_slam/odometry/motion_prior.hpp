// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/core/frame.hpp"
#include "hybrid_slam/odometry/visual_track.hpp"

namespace hybrid_slam {

enum class PriorKind {
    kNone,              ///< the robot is taken to stand still; only a start, without weight
    kConstantVelocity,  ///< the last motion goes on
    kWheel,             ///< wheel odometry; constant velocity in frames without it
    kVisual             ///< visual odometry; as kWheel in frames without it
};
std::string_view to_string(PriorKind kind);

struct MotionPriorConfig {
    PriorKind kind = PriorKind::kVisual;
    /// How far a prior is trusted: sigma = floor + ratio * motion, of translation and of rotation.
    double wheel_translation_floor = 0.02;  ///< metres
    double wheel_translation_ratio = 0.5;   ///< wheels slip, and some logs lie about reversing
    double wheel_rotation_floor = 0.01;     ///< radians
    double wheel_rotation_ratio = 0.3;
    double velocity_translation_floor = 0.05;  ///< metres
    double velocity_translation_ratio = 1.0;
    double velocity_rotation_floor = 0.05;  ///< radians
    double velocity_rotation_ratio = 1.0;
    double visual_scale = 0.01;         ///< share by which the camera's height and pitch mislead
    double visual_lever = 0.03;         ///< metres by which the camera may sit elsewhere
    double visual_extrapolation = 0.2;  ///< seconds beyond the newest image, at most
    double max_gap = 1.0;  ///< seconds between two scans; a longer one forgets the velocity
};

void describe(ConfigSchema& schema, MotionPriorConfig& config);

/// What is believed of the motion since the frame before, prior to looking at the scan.
struct MotionPrior {
    PriorKind used = PriorKind::kNone;
    Pose2d before_from_now;
    Eigen::Matrix3d information =
        Eigen::Matrix3d::Zero();                      ///< of (x, y, heading) of before_from_now
    Eigen::Vector3d twist = Eigen::Vector3d::Zero();  ///< at the scan, m/s, m/s, rad/s
};

/// Makes the prior of each frame from the frames before it.
class MotionPredictor {
  public:
    explicit MotionPredictor(const MotionPriorConfig& config) : config_(config) {}

    /// To be asked once for every frame in order.
    MotionPrior predict(const Frame& frame);

    /// Starts to try when the scan contradicts `prior`: that itself, constant velocity and standing
    /// still, all without weight.
    std::vector<MotionPrior> alternatives(const Frame& frame, const MotionPrior& prior) const;

    /// How many seconds the scan is newer than the newest image; below zero when it is older, empty
    /// before the first image.
    std::optional<double> visual_lag(const Frame& frame) const;

    /// To be told the motion that was found, once for every frame in order.
    void update(const Frame& frame, const Pose2d& before_from_now);

  private:
    std::optional<MotionPrior> from_vision(const Frame& frame) const;
    std::optional<MotionPrior> from_wheels(const Frame& frame) const;
    std::optional<MotionPrior> from_velocity(const Frame& frame) const;

    MotionPriorConfig config_;
    VisualTrack visual_;
    std::optional<double> stamp_;
    std::optional<Pose2d> odom_from_robot_;
    std::optional<Eigen::Vector3d> twist_;  ///< m/s, m/s, rad/s
};

}  // namespace hybrid_slam
