// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/simulator/world.hpp"

#include <algorithm>

#include "fan_caster.hpp"

namespace hybrid_slam {

double World::cast_ray(const Point2& origin, const Eigen::Vector2d& direction) const {
    double nearest = kNothingHit;
    for (const Segment& wall : walls) {
        nearest = std::min(nearest, hybrid_slam::cast_ray(wall, origin, direction));
    }
    for (const Circle& post : posts) {
        nearest = std::min(nearest, hybrid_slam::cast_ray(post, origin, direction));
    }
    return nearest;
}

}  // namespace hybrid_slam
