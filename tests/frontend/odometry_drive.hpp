// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <vector>

#include "hybrid_slam/odometry/odometry.hpp"
#include "support/room.hpp"

/// Drives for the odometry, and what it makes of them.
namespace hybrid_slam::test {

inline OdometryConfig config_of(PriorKind prior) {
    OdometryConfig config;
    config.prior.kind = prior;
    config.keyframe.distance = 0.4;
    config.keyframe.angle = radians(20.0);
    return config;
}

struct Outcome {
    std::vector<OdometryResult> results;
    double worst = 0.0;  ///< metres or radians, the pose against the truth at any frame
    std::map<PriorKind, int> priors;
    int kept = 0;  ///< keyframes
};

inline Outcome follow(const OdometryConfig& config, const std::vector<Frame>& frames,
                      const Trajectory& truth) {
    Odometry odometry(config);
    Outcome outcome;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        outcome.results.push_back(odometry.register_frame(frames[i]));
        const OdometryResult& result = outcome.results.back();
        outcome.worst = std::max(
            outcome.worst, apart(between(truth[0].pose, truth[i].pose), result.local_from_robot));
        ++outcome.priors[result.prior_used];
        outcome.kept += result.keyframe ? 1 : 0;
    }
    return outcome;
}

inline Lidar noisy_lidar() {
    Lidar lidar;
    lidar.beams = 541;
    lidar.field_of_view = radians(270.0);
    lidar.sigma = 0.01;
    return lidar;
}

struct Drive {
    World world = irregular_room();
    Trajectory truth = ellipse_lap(160);
    std::vector<Frame> frames = frames_along(world, truth, noisy_lidar(), 41);
};

/// Forward and back again through the room, 8 cm and a little turn a frame.
inline Trajectory there_and_back() {
    Trajectory truth;
    Pose2d pose(-2.0, -0.5, 0.1);
    for (int i = 0; i < 80; ++i) {
        truth.push_back({0.1 * i, pose});
        const double sign = i < 40 ? 1.0 : -1.0;
        pose = pose * Pose2d::exp(sign * Eigen::Vector3d(0.08, 0.0, 0.01));
    }
    return truth;
}

/// Frames whose wheels say `told(true step)` instead of the true step.
inline std::vector<Frame> with_wheels(
    const Trajectory& truth, const std::function<Pose2d(std::size_t, const Pose2d&)>& told) {
    std::vector<Frame> frames = frames_along(irregular_room(), truth, noisy_lidar(), 43);
    Pose2d odom;
    for (std::size_t i = 1; i < frames.size(); ++i) {
        odom = odom * told(i, between(truth[i - 1].pose, truth[i].pose));
        frames[i].odom_from_robot = odom;
    }
    return frames;
}

/// Motions of images five times as often as the scans, in between as the truth goes, each with an
/// error of its own.
inline std::vector<Frame> with_images(std::vector<Frame> frames, const Trajectory& truth,
                                      double sigma) {
    constexpr int kImages = 5;
    Rng rng(47);
    for (std::size_t i = 1; i < frames.size(); ++i) {
        frames[i].odom_from_robot.reset();
        const Pose2d step = between(truth[i - 1].pose, truth[i].pose);
        for (int k = 0; k < kImages; ++k) {
            VisualMotion motion;
            const double interval = (truth[i].stamp - truth[i - 1].stamp) / kImages;
            motion.from_stamp = truth[i - 1].stamp + k * interval;
            motion.stamp = k + 1 == kImages ? truth[i].stamp : motion.from_stamp + interval;
            motion.before_from_now =
                Pose2d::exp(step.log() / kImages) *
                Pose2d(gauss(rng, sigma), gauss(rng, sigma), gauss(rng, sigma));
            motion.covariance = std::max(sigma * sigma, 1e-10) * Eigen::Matrix3d::Identity();
            motion.status = VisualStatus::kGood;
            frames[i].visual.push_back(motion);
        }
        // The stamps of one motion after the other are the same to the bit.
        for (std::size_t k = 1; k < frames[i].visual.size(); ++k) {
            frames[i].visual[k].from_stamp = frames[i].visual[k - 1].stamp;
        }
    }
    return frames;
}

}  // namespace hybrid_slam::test
