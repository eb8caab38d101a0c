// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <vector>

#include "hybrid_slam/simulator/world.hpp"

namespace hybrid_slam {

inline constexpr double kNothingHit = std::numeric_limits<double>::infinity();

/// Distance along the ray to one wall or post; kNothingHit when it passes by.
double cast_ray(const Segment& wall, const Point2& origin, const Eigen::Vector2d& direction);
double cast_ray(const Circle& post, const Point2& origin, const Eigen::Vector2d& direction);

/// The beams of one sweep.
struct BeamFan {
    double angle_min = 0.0;        ///< radians
    double angle_increment = 0.0;  ///< radians
    std::size_t beams = 0;
};

/// A sweep that takes time: beam i is sent from the pose that lies i / (beams - 1) of the way from
/// the first to the last.
struct MovingLaser {
    Pose2d world_from_first;  ///< the laser at its first beam
    Pose2d world_from_last;
};

/// World::cast_ray for all beams at once, and past `people` who stand there besides: each wall and
/// post is tried only with the beams that point into the angle that it fills.
std::vector<double> cast_fan(const World& world, const MovingLaser& laser, const BeamFan& fan,
                             const std::vector<Circle>& people = {});

/// The same from one place.
inline std::vector<double> cast_fan(const World& world, const Pose2d& world_from_laser,
                                    const BeamFan& fan) {
    return cast_fan(world, MovingLaser{world_from_laser, world_from_laser}, fan);
}

}  // namespace hybrid_slam
