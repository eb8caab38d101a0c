// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/odometry/motion_prior.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

namespace hybrid_slam {

namespace {

Eigen::Matrix3d information_of(double translation_sigma, double rotation_sigma) {
    const double translation = 1.0 / (translation_sigma * translation_sigma);
    const double rotation = 1.0 / (rotation_sigma * rotation_sigma);
    return Eigen::Vector3d(translation, translation, rotation).asDiagonal();
}

}  // namespace

std::string_view to_string(PriorKind kind) {
    switch (kind) {
        case PriorKind::kNone:
            return "none";
        case PriorKind::kConstantVelocity:
            return "constant_velocity";
        case PriorKind::kWheel:
            return "wheel";
        case PriorKind::kVisual:
            return "visual";
    }
    return "unknown";
}

MotionPrior MotionPredictor::predict(const Frame& frame) {
    for (const VisualMotion& motion : frame.visual) {
        visual_.add(motion);
    }
    std::optional<MotionPrior> prior;
    if (config_.kind == PriorKind::kVisual) {
        prior = from_vision(frame);
    }
    if (!prior && (config_.kind == PriorKind::kVisual || config_.kind == PriorKind::kWheel)) {
        prior = from_wheels(frame);
    }
    if (!prior && config_.kind != PriorKind::kNone) {
        prior = from_velocity(frame);
    }
    return prior.value_or(MotionPrior());
}

std::vector<MotionPrior> MotionPredictor::alternatives(const Frame& frame,
                                                       const MotionPrior& prior) const {
    std::vector<MotionPrior> starts;
    if (config_.kind == PriorKind::kNone) {
        return starts;
    }
    starts.push_back(prior);
    if (auto velocity = from_velocity(frame);
        velocity && prior.used != PriorKind::kConstantVelocity) {
        starts.push_back(*velocity);
    }
    starts.emplace_back();
    for (MotionPrior& start : starts) {
        start.information.setZero();
    }
    return starts;
}

std::optional<double> MotionPredictor::visual_lag(const Frame& frame) const {
    const std::optional<double> newest = visual_.newest();
    return newest ? std::optional<double>(frame.scan.stamp - *newest) : std::nullopt;
}

std::optional<MotionPrior> MotionPredictor::from_vision(const Frame& frame) const {
    if (!stamp_) {
        return std::nullopt;
    }
    const auto motion = visual_.between(*stamp_, frame.scan.stamp, config_.visual_extrapolation);
    if (!motion) {
        return std::nullopt;
    }
    MotionPrior prior;
    prior.used = PriorKind::kVisual;
    prior.before_from_now = motion->from_from_to;
    // All steps are too long or too short alike, and turns swing the camera alike, so that this is
    // a matter of the whole motion.
    const double scale = config_.visual_scale * motion->from_from_to.translation.norm() +
                         config_.visual_lever * std::abs(motion->from_from_to.heading);
    Eigen::Matrix3d covariance = motion->covariance;
    covariance.diagonal().head<2>().array() += scale * scale;
    const Eigen::LLT<Eigen::Matrix3d> factor(covariance);
    if (factor.info() != Eigen::Success) {
        return std::nullopt;  // somebody's motion that claims to be exact
    }
    prior.information = factor.solve(Eigen::Matrix3d::Identity());
    prior.twist = motion->twist;
    return prior;
}

std::optional<MotionPrior> MotionPredictor::from_wheels(const Frame& frame) const {
    if (!odom_from_robot_ || !frame.odom_from_robot) {
        return std::nullopt;
    }
    MotionPrior prior;
    prior.used = PriorKind::kWheel;
    prior.before_from_now = between(*odom_from_robot_, *frame.odom_from_robot);
    if (const double elapsed = stamp_ ? frame.scan.stamp - *stamp_ : 0.0; elapsed > 1e-3) {
        prior.twist = prior.before_from_now.log() / elapsed;
    }
    const double distance = prior.before_from_now.translation.norm();
    const double angle = std::abs(prior.before_from_now.heading);
    prior.information =
        information_of(config_.wheel_translation_floor + config_.wheel_translation_ratio * distance,
                       config_.wheel_rotation_floor + config_.wheel_rotation_ratio * angle);
    return prior;
}

std::optional<MotionPrior> MotionPredictor::from_velocity(const Frame& frame) const {
    if (!twist_ || !stamp_) {
        return std::nullopt;
    }
    const double elapsed = frame.scan.stamp - *stamp_;
    if (!(elapsed >= 0.0 && elapsed <= config_.max_gap)) {
        return std::nullopt;
    }
    MotionPrior prior;
    prior.used = PriorKind::kConstantVelocity;
    prior.before_from_now = Pose2d::exp(elapsed * *twist_);
    prior.twist = *twist_;
    const double distance = prior.before_from_now.translation.norm();
    const double angle = std::abs(prior.before_from_now.heading);
    prior.information = information_of(
        config_.velocity_translation_floor + config_.velocity_translation_ratio * distance,
        config_.velocity_rotation_floor + config_.velocity_rotation_ratio * angle);
    return prior;
}

void MotionPredictor::update(const Frame& frame, const Pose2d& before_from_now) {
    const double elapsed = stamp_ ? frame.scan.stamp - *stamp_ : 0.0;
    if (elapsed > 1e-3 && elapsed <= config_.max_gap) {
        twist_ = before_from_now.log() / elapsed;
    } else if (elapsed > config_.max_gap) {
        twist_.reset();
    }
    stamp_ = frame.scan.stamp;
    visual_.forget_before(*stamp_);
    odom_from_robot_ = frame.odom_from_robot;
}

void describe(ConfigSchema& schema, MotionPriorConfig& config) {
    schema.add("wheel_translation_floor", config.wheel_translation_floor, 1e-4, 10.0,
               "m, trust in wheels: sigma = floor + ratio * distance");
    schema.add("wheel_translation_ratio", config.wheel_translation_ratio, 0.0, 10.0,
               "share of the distance driven");
    schema.add("wheel_rotation_floor", config.wheel_rotation_floor, 1e-4, 3.2, "rad");
    schema.add("wheel_rotation_ratio", config.wheel_rotation_ratio, 0.0, 10.0,
               "share of the angle turned");
    schema.add("velocity_translation_floor", config.velocity_translation_floor, 1e-4, 10.0,
               "m, trust in constant velocity");
    schema.add("velocity_translation_ratio", config.velocity_translation_ratio, 0.0, 10.0,
               "share of the distance driven");
    schema.add("velocity_rotation_floor", config.velocity_rotation_floor, 1e-4, 3.2, "rad");
    schema.add("velocity_rotation_ratio", config.velocity_rotation_ratio, 0.0, 10.0,
               "share of the angle turned");
    schema.add("visual_scale", config.visual_scale, 0.0, 1.0,
               "share by which the camera's height and pitch may mislead");
    schema.add("visual_lever", config.visual_lever, 0.0, 10.0,
               "m, by which the camera may sit elsewhere than it is said to");
    schema.add("visual_extrapolation", config.visual_extrapolation, 0.0, 10.0,
               "s, visual odometry is carried on beyond the newest image for so long");
    schema.add("max_gap", config.max_gap, 0.01, 60.0,
               "s, between two scans; a longer one forgets the velocity");
}

}  // namespace hybrid_slam
