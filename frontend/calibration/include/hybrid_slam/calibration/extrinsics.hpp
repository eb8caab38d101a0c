// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hybrid_slam/core/measurements.hpp"
#include "hybrid_slam/core/trajectory.hpp"

namespace hybrid_slam {

/// A drive as its two sensors saw it, each by itself, under mountings that were assumed.
struct ExtrinsicsDrive {
    /// local_from_robot at the stamps of the scans by scan matching without any vision; scans that
    /// could not be aligned are left out.
    Trajectory lidar;
    std::vector<VisualMotion> vision;  ///< in order; those that are not kGood are gaps
    Pose2d robot_from_laser;
    Pose2d robot_from_camera;  ///< x, y and yaw of the camera's mounting
};

/// Sigmas of a result beyond which it is of no use.
struct ExtrinsicsLimits {
    double time = 0.01;         ///< seconds
    double scale = 0.02;        ///< share
    double yaw = radians(0.5);  ///< radians
    double arm = 0.03;          ///< metres
};

struct ExtrinsicsConfig {
    double interval = 1.5;       ///< seconds over which the motions of both sensors are compared
    double slip_interval = 3.0;  ///< seconds over which the axle must not move sideways
    double max_gap = 0.6;        ///< seconds between two scans, or two images
    std::size_t least_intervals = 30;
    double least_distance = 4.0;         ///< metres
    double least_turned = radians(180);  ///< radians, to the left and to the right together
    double least_rate_spread = 0.05;     ///< rad/s, standard deviation of the turn rate
    ExtrinsicsLimits limits;
};

/// What is estimated, in the order of ExtrinsicsResult::sigmas.
enum class Extrinsic { kTime, kScale, kLaserYaw, kLaserX, kCameraYaw, kCameraX, kCameraY };
inline constexpr std::size_t kExtrinsics = 7;
std::string_view to_string(Extrinsic extrinsic);

struct ExtrinsicsResult {
    /// Seconds to be added to the stamps of images so that they fit those of the scans.
    double camera_time = 0.0;
    /// The visual way times this is the true one: so many times higher than assumed is the camera.
    double visual_scale = 1.0;
    Pose2d robot_from_laser;  ///< y as given: sliding along the axle changes nothing that is seen
    Pose2d robot_from_camera;
    /// One sigma each, of the order of Extrinsic: s, share, rad, m.
    std::array<double, kExtrinsics> sigmas{};
    double sigma(Extrinsic of) const { return sigmas[static_cast<std::size_t>(of)]; }

    /// What the drive lacks, in words for whoever drove; empty: the result may be used.
    std::vector<std::string> missing;
    bool fit() const { return missing.empty(); }
    /// Share by which the camera sees ways too long (negative: too short), which is what a wrong
    /// height does. Empty when the drive tells too little of the scale, or of anything.
    std::optional<double> ways_too_long() const;

    int iterations = 0;
    bool converged = false;
    std::size_t intervals = 0;     ///< compared
    std::size_t outliers = 0;      ///< of these, that hardly counted
    std::size_t standing = 0;      ///< left out since nothing moved
    std::size_t blind = 0;         ///< left out for gaps of vision
    double rms_translation = 0.0;  ///< metres, between the sensors over one interval, robust
    double rms_heading = 0.0;      ///< radians, likewise
    double rms_slip = 0.0;         ///< metres sideways over one slip_interval, robust
    double distance = 0.0;         ///< metres driven
    double turned_left = 0.0;      ///< radians, summed over the intervals
    double turned_right = 0.0;     ///< radians, likewise
    double rate_spread = 0.0;      ///< rad/s, standard deviation of the turn rate
};

/// Finds the time offset of the camera and where both sensors sit on a vehicle that drives on a
/// flat floor and whose origin, the middle of the fixed axle, cannot move sideways:
/// - hand-eye in SE(2): over an interval, laser_from_laser' X = X camera_from_camera' for the
///   rigid X = laser_from_camera (Shiu and Ahmad 1989, here with an unknown scale and time);
/// - no slip: the sideways part of the origin's motion sums up to zero.
/// Robust least squares from the assumed mountings, which may be off by 45 degrees and 0.3 s. The
/// sigmas allow for errors that last for some intervals. A drive that does not tell is no error but
/// says so in `missing`. Throws Error for an empty interval and values out of range.
ExtrinsicsResult calibrate_extrinsics(const ExtrinsicsDrive& drive,
                                      const ExtrinsicsConfig& config = {});

}  // namespace hybrid_slam
