// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "backend/localization/localization_support.hpp"

/// Two halls of which one can only be told from the other at their far ends.
namespace hybrid_slam::test {

inline const Pose2d kOther(21.37, 3.29, 0.0);  ///< from one look-alike hall to the other

inline void add_outline(World& world, const Pose2d& world_from_hall, const Points& corners) {
    const Points placed = transform(world_from_hall, corners);
    for (std::size_t i = 0; i < placed.size(); ++i) {
        world.walls.push_back({placed[i], placed[(i + 1) % placed.size()]});
    }
}

/// Two halls of 16 x 4 m with the same walls, but for a recess at the far end of the second one.
inline World twin_halls() {
    World world;
    const Points near_end{{3.0, 4.0}, {3.0, 4.8}, {1.5, 4.8}, {1.5, 4.0}, {0.0, 4.0}, {0.0, 0.0},
                          {6.0, 0.0}, {6.0, 0.7}, {7.0, 0.7}, {7.0, 0.0}, {16.0, 0.0}};
    Points first = near_end;
    first.emplace_back(16.0, 4.0);
    Points second = near_end;
    for (const Point2& corner :
         Points{{16.0, 4.0}, {14.5, 4.0}, {14.5, 5.2}, {13.0, 5.2}, {13.0, 4.0}}) {
        second.push_back(corner);
    }
    add_outline(world, {}, first);
    add_outline(world, kOther, second);
    // Pillars, so that odometry does not slip along bare walls.
    for (double x = 2.0; x < 16.0; x += 2.3) {
        for (const Pose2d& world_from_hall : {Pose2d(), kOther}) {
            add_outline(world, world_from_hall,
                        {{x, 0.3}, {x + 0.3, 0.3}, {x + 0.3, 0.6}, {x, 0.6}});
        }
    }
    return world;
}

inline std::vector<Pose2d> poses_in_both() {
    std::vector<Pose2d> poses;
    for (double x = 1.0; x < 15.5; x += 0.5) {
        for (const double heading : {0.0, kPi / 2.0, -kPi / 2.0, -kPi}) {
            poses.emplace_back(x, 2.0, heading);
            poses.push_back(kOther * poses.back());
        }
    }
    return poses;
}

/// One map for all tests: it is never changed.
inline const std::shared_ptr<const ReferenceMap>& halls() {
    static const auto map = reference_of(stored_map_of(twin_halls(), poses_in_both()));
    return map;
}

}  // namespace hybrid_slam::test
