// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "hybrid_slam/simulator/world.hpp"
#include "hybrid_slam/vehicle/forklift.hpp"

namespace hybrid_slam {

/// The vehicle's outline as a rectangle in its own frame, metres.
struct Footprint {
    explicit Footprint(const VehicleConfig& vehicle);

    /// A point of the shape that lies within; empty when there is none. Touching counts.
    std::optional<Point2> meets(const Segment& wall_in_robot) const;
    std::optional<Point2> meets(const Circle& post_in_robot) const;

    Point2 least;
    Point2 most;
};

struct Obstacle {
    std::string name;  ///< "wall 3", "post 0", "person 1": by their order in the world
    Point2 at;         ///< in the world
};

/// What the vehicle reaches into first, in the order walls, posts, `people`.
std::optional<Obstacle> touched(const World& world, const std::vector<Circle>& people,
                                const Footprint& footprint, const Pose2d& world_from_robot);

}  // namespace hybrid_slam
