// SPDX-License-Identifier: Apache-2.0
#include "footprint.hpp"

#include <algorithm>

namespace hybrid_slam {

Footprint::Footprint(const VehicleConfig& vehicle)
    : least(-vehicle.footprint_rear, -vehicle.footprint_width / 2.0),
      most(vehicle.footprint_front, vehicle.footprint_width / 2.0) {}

/// Clipped by one pair of sides after the other (Liang and Barsky 1984).
std::optional<Point2> Footprint::meets(const Segment& wall_in_robot) const {
    const Eigen::Vector2d along = wall_in_robot.end - wall_in_robot.start;
    double enter = 0.0;
    double leave = 1.0;
    for (int axis = 0; axis < 2; ++axis) {
        const double start = wall_in_robot.start[axis];
        if (along[axis] == 0.0) {
            if (start < least[axis] || start > most[axis]) {
                return std::nullopt;
            }
            continue;
        }
        const double one = (least[axis] - start) / along[axis];
        const double other = (most[axis] - start) / along[axis];
        enter = std::max(enter, std::min(one, other));
        leave = std::min(leave, std::max(one, other));
    }
    if (enter > leave) {
        return std::nullopt;
    }
    return wall_in_robot.start + 0.5 * (enter + leave) * along;
}

std::optional<Point2> Footprint::meets(const Circle& post_in_robot) const {
    const Point2 nearest = post_in_robot.center.cwiseMax(least).cwiseMin(most);
    if ((nearest - post_in_robot.center).norm() > post_in_robot.radius) {
        return std::nullopt;
    }
    return nearest;
}

namespace {

template <typename Shape>
std::optional<Obstacle> touched_of(const std::vector<Shape>& shapes, const char* kind,
                                   const Footprint& footprint, const Pose2d& world_from_robot) {
    const Pose2d robot_from_world = world_from_robot.inverse();
    for (std::size_t i = 0; i < shapes.size(); ++i) {
        Shape shape = shapes[i];
        if constexpr (std::is_same_v<Shape, Segment>) {
            shape = {robot_from_world * shape.start, robot_from_world * shape.end};
        } else {
            shape.center = robot_from_world * shape.center;
        }
        if (const auto at = footprint.meets(shape)) {
            return Obstacle{kind + std::to_string(i), world_from_robot * *at};
        }
    }
    return std::nullopt;
}

}  // namespace

std::optional<Obstacle> touched(const World& world, const std::vector<Circle>& people,
                                const Footprint& footprint, const Pose2d& world_from_robot) {
    std::optional<Obstacle> found = touched_of(world.walls, "wall ", footprint, world_from_robot);
    if (!found) {
        found = touched_of(world.posts, "post ", footprint, world_from_robot);
    }
    if (!found) {
        found = touched_of(people, "person ", footprint, world_from_robot);
    }
    return found;
}

}  // namespace hybrid_slam
