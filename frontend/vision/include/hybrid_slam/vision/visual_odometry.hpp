// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string_view>

#include "hybrid_slam/core/camera_model.hpp"
#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/core/measurements.hpp"
#include "hybrid_slam/vision/floor_mask.hpp"

namespace hybrid_slam {

enum class VisualMethod {
    kThesis,  ///< means over sky and ground features, equations 3.1 to 3.5 of section 3.4.2
    kJoint    ///< heading and translation solved together, robustly, with the true geometry
};
std::string_view to_string(VisualMethod method);

struct VisualOdometryConfig {
    VisualMethod method = VisualMethod::kJoint;
    int features = 160;        ///< followed at most
    int least_features = 12;   ///< with fewer there is no motion
    double thesis_line = 0.5;  ///< share of the image's height above which the thesis has sky
    double keyframe_distance = 0.25;       ///< metres; features are followed from there
    double keyframe_angle = radians(6.0);  ///< radians
    double pixel_sigma = 0.25;             ///< pixels, of a followed feature
    double dark = 20.0;                    ///< mean gray level below which an image is too dark
    bool lidar_border = true;              ///< floor and walls told apart by the scan
    double tilt_sigma = radians(0.02);  ///< radians, of pitch and roll from one image to the next
    /// Radians by which pitch and yaw of the mounting may be off; learned while driving.
    double aim_sigma = radians(0.05);
};

/// Lists the keys without a section before them.
void describe(ConfigSchema& schema, VisualOdometryConfig& config);

/// Motion from the images of one camera on a flat floor. Deterministic.
class VisualOdometry {
  public:
    /// Throws Error for a camera that cannot be (a focal length of zero) and values out of range.
    VisualOdometry(const CameraModel& model, const CameraMounting& mounting,
                   const VisualOdometryConfig& config = {},
                   std::unique_ptr<FloorSegmenter> segmenter = nullptr);
    ~VisualOdometry();
    VisualOdometry(VisualOdometry&&) noexcept;
    VisualOdometry& operator=(VisualOdometry&&) noexcept;

    /// The newest scan says where floor ends and walls begin, for the images around its stamp.
    void see(const Scan& scan);

    /// Whether the image is whole and as large as the camera model says.
    bool accepts(const Image& image) const;

    /// The motion since the image before. Gray or BGR; throws Error for an image that is torn or of
    /// another size than the camera model's, and for a stamp that is not later than the last one.
    VisualMotion track(const Image& image);

    /// Forgets all images: the next one is the first again, at whatever time.
    void restart();

    /// What was followed in the image of the last call, for pictures and counts.
    struct Feature {
        Pixel before;
        Pixel now;
        bool floor = false;
        bool used = false;  ///< agreed with the motion
    };
    const std::vector<Feature>& features() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
