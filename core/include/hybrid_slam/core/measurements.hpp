// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <string_view>
#include <variant>
#include <vector>

#include "hybrid_slam/core/points.hpp"

namespace hybrid_slam {

/// What a safety scanner says of a single beam besides its range; bits to be or-ed.
enum BeamFlag : std::uint8_t {
    kProtectiveField = 1,  ///< the measured value lies inside the protective field
    kWarningField = 2,     ///< inside the warning field
    kReflector = 4         ///< a reflector was hit, or the scanner was dazzled
};

/// One sweep of a planar lidar. Beam i points at angle_min + i * angle_increment in the laser
/// frame.
struct Scan {
    double stamp = 0.0;  ///< seconds, of the first beam
    /// Metres; anything outside [range_min, range_max) is no return, NaN where nobody looked.
    std::vector<float> ranges;
    double angle_min = 0.0;        ///< radians
    double angle_increment = 0.0;  ///< radians
    double range_min = 0.0;        ///< metres
    double range_max = 0.0;        ///< metres; a reading of this or more is no return
    double time_increment = 0.0;   ///< seconds between beams; 0 = not known, so no deskew
    Pose2d robot_from_laser;
    std::vector<std::uint8_t> flags;  ///< BeamFlag bits of each beam; empty = the scanner says none

    double angle(std::size_t beam) const {
        return angle_min + static_cast<double>(beam) * angle_increment;
    }
    /// False for no-returns, inf and NaN.
    bool is_return(float range) const { return range >= range_min && range < range_max; }
    /// Whether any beam carries the flag.
    bool has(BeamFlag flag) const {
        return std::any_of(flags.begin(), flags.end(),
                           [flag](std::uint8_t bits) { return (bits & flag) != 0; });
    }
};

/// One camera image, rows top to bottom, channels interleaved (1 = gray, 3 = BGR).
struct Image {
    double stamp = 0.0;  ///< seconds
    int width = 0;
    int height = 0;
    int channels = 1;
    std::vector<std::uint8_t> pixels;  ///< width * height * channels bytes
};

/// Whether the pixels are as many as width, height and channels say, and these are 1 or 3.
bool is_consistent(const Image& image);

/// The pose of the robot by its wheels, in a frame that drifts.
struct WheelOdometry {
    double stamp = 0.0;  ///< seconds
    Pose2d odom_from_robot;
};

/// What visual odometry says of the motion between two images.
enum class VisualStatus {
    kFirst,           ///< there is no image before
    kGood,            ///< the motion is measured
    kTooDark,         ///< or covered: no usable light, or none of it has any contrast
    kBlurred,         ///< smeared by motion or out of focus
    kTooFewFeatures,  ///< too little to follow
    kGroundHidden,    ///< hardly any floor seen: the way driven is uncertain, the heading is not
    kInconsistent     ///< what was followed does not move as one rigid scene
};
std::string_view to_string(VisualStatus status);

/// Whether there is a motion at all.
inline bool is_usable(VisualStatus status) {
    return status == VisualStatus::kGood || status == VisualStatus::kGroundHidden;
}

/// The motion of the robot between two consecutive images, by what the camera sees and by how a
/// vehicle moves; never by matching scans.
struct VisualMotion {
    double from_stamp = 0.0;  ///< seconds, of the image before
    double stamp = 0.0;       ///< seconds, of this image
    Pose2d before_from_now;
    /// Of (x, y, heading) of before_from_now: m2, m rad, rad2. Without what a wrong height or pitch
    /// of the camera does to all motions alike.
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    VisualStatus status = VisualStatus::kFirst;

    bool usable() const { return is_usable(status); }
};

using Measurement = std::variant<Scan, Image, WheelOdometry, VisualMotion>;

}  // namespace hybrid_slam
