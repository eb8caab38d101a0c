// SPDX-License-Identifier: Apache-2.0
#include <hybrid_slam/core/trajectory.hpp>
#include <iostream>

int main() {
    const hybrid_slam::Pose2d map_from_robot(1.0, 2.0, hybrid_slam::kPi / 2);
    hybrid_slam::write_tum("one.tum", {{0.5, map_from_robot}});
    const hybrid_slam::Pose2d read = hybrid_slam::read_tum("one.tum").front().pose;
    std::cout << read << '\n';
    return between(map_from_robot, read).translation.norm() < 1e-6 ? 0 : 1;
}
