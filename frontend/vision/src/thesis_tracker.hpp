// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "camera_on_robot.hpp"
#include "feature_tracker.hpp"
#include "visual_tracker.hpp"

namespace hybrid_slam {

/// The method of the thesis, section 3.4.2: a fixed line divides sky from ground; the heading is
/// the mean change of the angles of sky features, the translation the mean shift of the ground
/// features in the bird's eye view below the camera. The camera counts as the robot, as it does
/// there: one that sits ahead of the turning centre makes a turn look like sideways motion.
class ThesisTracker : public VisualTracker {
  public:
    ThesisTracker(const CameraOnRobot& camera, const VisualOdometryConfig& config);

    void see(const Scan& /*scan*/) override {}
    VisualMotion track(const Image& image) override;
    void restart() override;
    const Features& features() const override { return features_; }

  private:
    struct Mean {
        Eigen::Vector2d value = Eigen::Vector2d::Zero();
        double variance = 0.0;  ///< of the mean, per axis
        std::size_t count = 0;
    };

    VisualStatus measure(VisualMotion& motion);
    double heading_change(double& variance, std::size_t& count) const;
    Mean translation(double heading_change) const;
    std::optional<Eigen::Vector2d> on_floor(const Pixel& pixel) const;

    CameraOnRobot camera_;
    VisualOdometryConfig config_;
    Eigen::Matrix3d floor_from_image_;
    Pyramid before_;
    ImagePoints history_;
    std::optional<double> stamp_;
    Features features_;
};

}  // namespace hybrid_slam
