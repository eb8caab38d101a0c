// SPDX-License-Identifier: Apache-2.0
#include <hybrid_slam/odometry/odometry.hpp>
#include <iostream>

int main() {
    // A wall ahead and one to the left, as a lidar with 181 beams sees them.
    hybrid_slam::Frame frame;
    frame.scan.angle_min = -hybrid_slam::kPi / 2;
    frame.scan.angle_increment = hybrid_slam::kPi / 180;
    frame.scan.range_max = 30.0;
    for (int i = 0; i <= 180; ++i) {
        const double angle = frame.scan.angle(static_cast<std::size_t>(i));
        const double ahead = 3.0 / std::max(std::cos(angle), 1e-3);
        const double left = angle > 0.0 ? 2.0 / std::sin(angle) : 100.0;
        frame.scan.ranges.push_back(static_cast<float>(std::min(ahead, left)));
    }

    hybrid_slam::Odometry odometry{hybrid_slam::OdometryConfig{}};
    odometry.register_frame(frame);
    frame.scan.stamp = 0.1;
    const hybrid_slam::OdometryResult result = odometry.register_frame(frame);
    std::cout << to_string(result.icp.status) << " at " << result.local_from_robot << '\n';
    return result.icp.usable() && result.local_from_robot.translation.norm() < 1e-3 ? 0 : 1;
}
