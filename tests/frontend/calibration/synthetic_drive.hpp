// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <functional>
#include <random>

#include "hybrid_slam/calibration/extrinsics.hpp"

/// Drives whose truth is known, as a lidar and a camera with given errors would tell them.
namespace hybrid_slam::test {

/// Speed (m/s) and turn rate (rad/s) at a time.
using Driving = std::function<Eigen::Vector2d(double)>;

/// Eights, not quite regular, from standstill to standstill.
inline Driving figure_of_eight(double seconds) {
    return [seconds](double time) -> Eigen::Vector2d {
        const double ramp = std::min({1.0, time / 0.8, (seconds - time) / 0.8});
        const double speed = 0.3 * std::max(0.0, ramp) * (1.0 + 0.1 * std::sin(0.37 * time));
        const double rate = 0.35 * std::sin(2.0 * kPi * time / 22.0) + 0.1 * std::sin(1.3 * time);
        return {speed, ramp > 0.0 ? rate : 0.0};
    };
}

/// The way driven, at any time.
class Way {
  public:
    Way(const Driving& driving, double seconds) {
        poses_.emplace_back();
        for (double time = 0.5 * kStep; time < seconds; time += kStep) {
            const Eigen::Vector2d now = driving(time);
            const Eigen::Vector3d twist(now.x(), 0.0, now.y());
            poses_.push_back(poses_.back() * Pose2d::exp(kStep * twist));
        }
    }
    Pose2d at(double time) const {
        const double steps = std::max(0.0, time / kStep);
        const auto before = std::min(static_cast<std::size_t>(steps), poses_.size() - 2);
        const double ratio = std::min(1.0, steps - static_cast<double>(before));
        return interpolate(poses_[before], poses_[before + 1], ratio);
    }

  private:
    static constexpr double kStep = 0.002;  // seconds
    std::vector<Pose2d> poses_;
};

/// What is true, and how well the sensors see.
struct SyntheticSensors {
    Pose2d robot_from_laser{1.3, 0.1, radians(1.0)};
    Pose2d robot_from_camera{1.2, -0.05, radians(-2.0)};
    double camera_time = 0.0;  ///< to be added to the stamps of images
    double visual_scale = 1.0;
    double scan_rate = 12.5;
    double image_rate = 30.0;
    double lidar_translation = 0.0;   ///< metres, sigma of a pose
    double lidar_heading = 0.0;       ///< radians, likewise
    double vision_translation = 0.0;  ///< metres, sigma of a motion between two images
    double vision_heading = 0.0;      ///< radians, likewise
    unsigned seed = 1;
};

/// The drive as it would be told under the mountings that are assumed.
inline ExtrinsicsDrive drive_of(const Way& way, double seconds, const SyntheticSensors& sensors,
                                const Pose2d& assumed_laser, const Pose2d& assumed_camera) {
    std::mt19937 rng(sensors.seed);
    const auto noise = [&](double translation, double heading) {
        std::normal_distribution<double> gauss;
        const double x = translation * gauss(rng);
        const double y = translation * gauss(rng);
        return Pose2d(x, y, heading * gauss(rng));
    };
    ExtrinsicsDrive drive;
    drive.robot_from_laser = assumed_laser;
    drive.robot_from_camera = assumed_camera;
    for (double time = 0.0; time < seconds; time += 1.0 / sensors.scan_rate) {
        const Pose2d laser = way.at(time) * sensors.robot_from_laser *
                             noise(sensors.lidar_translation, sensors.lidar_heading);
        drive.lidar.push_back({time, laser * assumed_laser.inverse()});
    }
    const double period = 1.0 / sensors.image_rate;
    for (double time = 0.02; time + period < seconds; time += period) {
        VisualMotion motion;
        motion.status = VisualStatus::kGood;
        motion.from_stamp = time - sensors.camera_time;
        motion.stamp = motion.from_stamp + period;
        Pose2d moved = between(way.at(time) * sensors.robot_from_camera,
                               way.at(time + period) * sensors.robot_from_camera) *
                       noise(sensors.vision_translation, sensors.vision_heading);
        moved.translation /= sensors.visual_scale;
        motion.before_from_now = assumed_camera * moved * assumed_camera.inverse();
        drive.vision.push_back(motion);
    }
    // Stamps are the running time, from image to image without any rounding.
    for (std::size_t i = 1; i < drive.vision.size(); ++i) {
        drive.vision[i].from_stamp = drive.vision[i - 1].stamp;
    }
    return drive;
}

}  // namespace hybrid_slam::test
