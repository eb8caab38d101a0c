// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vision/visual_odometry.hpp"

#include <cmath>
#include <optional>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "joint_tracker.hpp"
#include "thesis_tracker.hpp"

namespace hybrid_slam {

struct VisualOdometry::State {
    int width = 0;
    int height = 0;
    std::optional<double> newest;  ///< seconds
    std::unique_ptr<VisualTracker> tracker;
};

std::string_view to_string(VisualMethod method) {
    switch (method) {
        case VisualMethod::kThesis:
            return "thesis";
        case VisualMethod::kJoint:
            return "joint";
    }
    return "unknown";
}

VisualOdometry::VisualOdometry(const CameraModel& model, const CameraMounting& mounting,
                               const VisualOdometryConfig& config,
                               std::unique_ptr<FloorSegmenter> segmenter)
    : state_(std::make_unique<State>()) {
    VisualOdometryConfig checked = config;
    CameraModel checked_model = model;
    CameraMounting checked_mounting = mounting;
    ConfigSchema schema;  // throws for values out of their ranges
    describe(schema, checked);
    describe(schema, checked_model);
    describe(schema, checked_mounting);
    if (config.least_features > config.features) {
        throw Error("vo.least_features: must not exceed vo.features");
    }
    state_->width = model.width;
    state_->height = model.height;
    const CameraOnRobot camera(model, mounting);
    if (config.method == VisualMethod::kThesis) {
        state_->tracker = std::make_unique<ThesisTracker>(camera, config);
    } else {
        state_->tracker = std::make_unique<JointTracker>(camera, config, std::move(segmenter));
    }
}

VisualOdometry::~VisualOdometry() = default;
VisualOdometry::VisualOdometry(VisualOdometry&&) noexcept = default;
VisualOdometry& VisualOdometry::operator=(VisualOdometry&&) noexcept = default;

void VisualOdometry::see(const Scan& scan) {
    state_->tracker->see(scan);
}

bool VisualOdometry::accepts(const Image& image) const {
    return is_consistent(image) && image.width == state_->width && image.height == state_->height;
}

VisualMotion VisualOdometry::track(const Image& image) {
    if (!accepts(image)) {
        throw Error("a torn image, or one of " + std::to_string(image.width) + " x " +
                    std::to_string(image.height) + " pixels; the camera model has " +
                    std::to_string(state_->width) + " x " + std::to_string(state_->height));
    }
    if (!std::isfinite(image.stamp) || (state_->newest && image.stamp <= *state_->newest)) {
        throw Error("an image whose stamp is not later than that of the one before");
    }
    state_->newest = image.stamp;
    return state_->tracker->track(image);
}

void VisualOdometry::restart() {
    state_->newest.reset();
    state_->tracker->restart();
}

const std::vector<VisualOdometry::Feature>& VisualOdometry::features() const {
    return state_->tracker->features();
}

void describe(ConfigSchema& schema, VisualOdometryConfig& config) {
    schema.add("method", config.method,
               {{"thesis", VisualMethod::kThesis}, {"joint", VisualMethod::kJoint}},
               "thesis: means over sky and ground features; joint: all solved together");
    schema.add("features", config.features, 20, 2000, "followed at most");
    schema.add("least_features", config.least_features, 6, 1000, "with fewer there is no motion");
    schema.add("thesis_line", config.thesis_line, 0.0, 1.0,
               "share of the image's height above which the thesis has its sky");
    schema.add("keyframe_distance", config.keyframe_distance, 0.0, 10.0,
               "m, features are followed for so long");
    schema.add_degrees("keyframe_angle_deg", config.keyframe_angle, 0.0, 90.0, "deg, likewise");
    schema.add("pixel_sigma", config.pixel_sigma, 0.01, 10.0, "pixels, of a followed feature");
    schema.add_degrees("tilt_sigma_deg", config.tilt_sigma, 0.001, 10.0,
                       "deg, by which the camera nods and rolls");
    schema.add_degrees("aim_sigma_deg", config.aim_sigma, 1e-4, 20.0,
                       "deg, by which pitch and yaw of the mounting may be off");
    schema.add("dark", config.dark, 0.0, 255.0, "mean gray level below which an image is too dark");
    schema.add("lidar_border", config.lidar_border, "tell floor from walls by the scan");
}

}  // namespace hybrid_slam
