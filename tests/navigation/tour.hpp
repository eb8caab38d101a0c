// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid_slam/simulator/world.hpp"
#include "hybrid_slam/vehicle/forklift.hpp"
#include "navigation/closed_loop.hpp"

namespace hybrid_slam::test {

/// The tour of the thesis's tables 4.26 to 4.29: kidnapped to the start, past the first place, to
/// the second. Metres, in the world thesis_hall.
inline const Pose2d kTourStart{0.0, 1.6, 0.0};
inline const std::vector<Eigen::Vector2d> kTourPlaces{{1.30, -0.15}, {-2.40, -1.60}};

/// Metres that an estimate is off the truth.
struct TourErrors {
    double start = 0.0;   ///< of the first pose
    double first = 0.0;   ///< when truly nearest to the first place
    double second = 0.0;  ///< of the last pose
};
struct TourResult {
    TourErrors slam;      ///< of the poses that the drive was given
    double passed = 0.0;  ///< metres, from the first place at its nearest
    double missed = 0.0;  ///< metres, from the last place where the truck stands
    int contacts = 0;
    bool arrived = false;
    std::string why;
};

/// What is held against the truth is a trajectory in the world; stamps are of the simulator's
/// clock.
TourErrors tour_errors(const Trajectory& world_from_robot, const Trajectory& truth);

TourResult judge_tour(const ClosedLoop& loop, const LoopMap& map, const Trip& trip);

/// The drive of a lockstep run once more, from the commands on its bus: the same scans, as a
/// recording in `out`. Throws Error when it does not go where the truck went.
void record_again(const ClosedLoop& loop, const LoopMap& map, int seed,
                  const std::filesystem::path& out);

/// Metres from the outline of a truck that stands there to the nearest wall or post; 0 when it
/// touches one, or is about it.
double true_clearance(const World& world, const VehicleConfig& vehicle,
                      const Pose2d& world_from_robot);

}  // namespace hybrid_slam::test
