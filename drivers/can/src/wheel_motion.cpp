// SPDX-License-Identifier: Apache-2.0
#include "wheel_motion.hpp"

#include <cmath>

#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {
namespace {

/// rpm of the motor at 1 m/s of its wheel: 60 gear / (2 pi r).
double rpm_per_speed(const DriveLayout& layout) {
    const double magnitude = 60.0 * layout.gear / (2.0 * kPi * layout.wheel_radius);
    return layout.drive_inverted ? -magnitude : magnitude;
}

/// Bicycle model: axle and steered wheel turn about one centre, with radii r and r / cos(steering),
/// at whichever end the wheel is.
double axle_share(const DriveLayout& layout, double steering) {
    return layout.speed_of == SpeedOf::kWheel ? std::cos(steering) : 1.0;
}

}  // namespace

double rpm_from_speed(const DriveLayout& layout, double speed, double steering) {
    return rpm_per_speed(layout) * speed / axle_share(layout, steering);
}

double speed_from_rpm(const DriveLayout& layout, double rpm, double steering) {
    return rpm / rpm_per_speed(layout) * axle_share(layout, steering);
}

double straighter(double commanded, std::optional<double> measured) {
    return measured && std::abs(*measured) < std::abs(commanded) ? *measured : commanded;
}

double truck_degrees(const DriveLayout& layout, double steering) {
    return layout.steering_inverted ? -degrees(steering) : degrees(steering);
}

double steering_from(const DriveLayout& layout, double truck_degrees) {
    return radians(layout.steering_inverted ? -truck_degrees : truck_degrees);
}

}  // namespace hybrid_slam
