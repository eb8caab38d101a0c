// SPDX-License-Identifier: Apache-2.0
// Aligns two scans of an L-shaped room and prints the motion between them.
#include <cmath>
#include <iostream>

#include "hybrid_slam/odometry/scan_filter.hpp"
#include "hybrid_slam/registration/icp.hpp"
#include "hybrid_slam/simulator/world.hpp"

using hybrid_slam::Pose2d;

namespace {

hybrid_slam::Scan scan_from(const hybrid_slam::World& world, const Pose2d& world_from_laser) {
    hybrid_slam::Scan scan;
    scan.angle_min = hybrid_slam::radians(-135.0);
    scan.angle_increment = hybrid_slam::radians(0.5);
    scan.range_max = 30.0;
    for (std::size_t beam = 0; beam < 541; ++beam) {
        const double angle = world_from_laser.heading + scan.angle(beam);
        scan.ranges.push_back(static_cast<float>(
            world.cast_ray(world_from_laser.translation, {std::cos(angle), std::sin(angle)})));
    }
    return scan;
}

}  // namespace

int main() {
    hybrid_slam::World room;
    const hybrid_slam::Points corners{{-3, -2}, {5, -2}, {5, 1}, {1, 1}, {1, 4}, {-3, 4}};
    for (std::size_t i = 0; i < corners.size(); ++i) {
        room.walls.push_back({corners[i], corners[(i + 1) % corners.size()]});
    }
    const Pose2d world_from_first(0.0, 0.0, 0.3);
    const Pose2d world_from_second(0.35, -0.2, 0.5);

    const hybrid_slam::ScanFilterConfig filter;
    const hybrid_slam::Reference reference(to_surface(scan_from(room, world_from_first), filter));
    const hybrid_slam::Surface second = to_surface(scan_from(room, world_from_second), filter);

    const hybrid_slam::IcpGuess guess;  // nothing known: start from no motion
    const hybrid_slam::IcpResult result = align(second, reference, guess);

    std::cout << to_string(result.status) << " after " << result.iterations << " iterations, "
              << 100.0 * result.overlap << " % of the points explained\n"
              << "found " << result.reference_from_points << '\n'
              << "true  " << between(world_from_first, world_from_second) << '\n';
    return result.usable() ? 0 : 1;
}
