// SPDX-License-Identifier: Apache-2.0
#include "pose_predictor.hpp"

#include <algorithm>

#include "hybrid_slam/core/uncertainty.hpp"

namespace hybrid_slam {
namespace {

constexpr double kMostLatency = 1.0;  // seconds that images come later than scans
constexpr double kClockSet = 5.0;     // seconds back that are no repetition but another clock

}  // namespace

void PosePredictor::see(const VisualMotion& motion) {
    if (const auto newest = track_.newest(); newest && motion.stamp <= *newest) {
        if (motion.stamp > *newest - kClockSet) {
            return;
        }
        track_ = VisualTrack();
    }
    track_.add(motion);
}

void PosePredictor::anchor(const PredictedPose& pose) {
    if (!poses_.empty() && pose.stamp <= poses_.back().stamp) {
        poses_.clear();
    }
    poses_.push_back(pose);
    while (poses_.front().stamp < pose.stamp - kMostLatency) {
        poses_.pop_front();
    }
    track_.forget_before(poses_.front().stamp);
}

void PosePredictor::forget() {
    poses_.clear();
}

std::optional<PredictedPose> PosePredictor::at(double stamp) const {
    const auto from = std::find_if(poses_.rbegin(), poses_.rend(),
                                   [stamp](const auto& pose) { return pose.stamp <= stamp; });
    if (from == poses_.rend()) {
        return std::nullopt;
    }
    if (from->stamp == stamp) {
        return *from;
    }
    const auto motion = track_.between(from->stamp, stamp, 0.0);
    if (!motion) {
        return std::nullopt;
    }
    PredictedPose pose;
    pose.stamp = stamp;
    pose.map_from_robot = from->map_from_robot * motion->from_from_to;
    // What a wrong height of the camera or a wrong lever does, as the odometry's prior has it.
    const double scale = config_.visual_scale * motion->from_from_to.translation.norm() +
                         config_.visual_lever * std::abs(motion->from_from_to.heading);
    Eigen::Matrix3d step = motion->covariance;
    step.diagonal().head<2>().array() += scale * scale;
    pose.covariance = swung(from->covariance,
                            pose.map_from_robot.translation - from->map_from_robot.translation) +
                      turned(step, from->map_from_robot.rotation());
    return pose;
}

}  // namespace hybrid_slam
