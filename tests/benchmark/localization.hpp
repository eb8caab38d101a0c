// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <random>
#include <string>
#include <vector>

#include "benchmarks.hpp"
#include "hybrid_slam/core/trajectory.hpp"
#include "hybrid_slam/localization/relocalization.hpp"
#include "hybrid_slam/simulator/simulated_vehicle.hpp"
#include "session.hpp"

namespace hybrid_slam {

/// A simulated world as our own mapping has it.
struct MappedWorld {
    World world;
    SlamMap map;
    std::shared_ptr<const ReferenceMap> reference;
    Trajectory truth;       ///< world_from_robot of the keyframes
    Pose2d map_from_world;  ///< best fit of the drive that made the map

    /// By the keyframe nearest in truth: what the map says of this place, however bent it is.
    Pose2d expected(const Pose2d& world_from_robot) const;
};

/// What is read of a map when it is stored.
std::shared_ptr<const ReferenceMap> reference_of(const SlamMap& map);

/// Drives the forklift with its lidar alone along a path of the world, and maps.
MappedWorld map_world(const World& world, const std::string& path,
                      const SimulatedDriveConfig& config);
/// As a mapping without any error would have it: keyframes every 0.4 m at the true poses.
MappedWorld map_truly(const World& world, const std::string& path);

/// What the forklift that stands there sees: whole centimetres, 541 beams.
Scan scan_at(const World& world, const Pose2d& world_from_robot, const Pose2d& robot_from_laser,
             double sigma, double bias, std::mt19937& random);
Sweep sweep_at(const World& world, const Pose2d& world_from_robot, const Pose2d& robot_from_laser,
               double sigma, double bias, std::mt19937& random);

/// Random poses with the laser in mapped free space, and neither robot nor laser near a wall.
std::vector<Pose2d> random_poses(const MappedWorld& mapped, std::size_t count,
                                 const Pose2d& robot_from_laser, unsigned seed);

/// Verdicts held against what is true.
struct Tally {
    std::size_t asked = 0;
    std::size_t right = 0;  ///< found, and there
    std::size_t wrong = 0;  ///< found elsewhere: wrong but sure
    std::size_t ambiguous = 0;
    std::size_t listed = 0;  ///< of these, with the true place in the list
    std::size_t not_in_map = 0;
    std::size_t unfinished = 0;
    double worst_seconds = 0.0;
    double seconds = 0.0;

    void take(const Relocalization& found, const Pose2d& expected, double elapsed);
    std::string text() const;
};

/// Right within 25 cm and 3 degrees.
bool is_there(const Pose2d& found, const Pose2d& expected);

// Each prints what was measured beside what is asked, and returns how many figures miss.
int measure_table_poses(const LocalizationOptions& options, std::ostream& out);
int measure_hall_poses(const LocalizationOptions& options, std::ostream& out);
int measure_racks(const LocalizationOptions& options, std::ostream& out);
int measure_rack_drives(const LocalizationOptions& options, std::ostream& out);
int measure_symmetric(const LocalizationOptions& options, std::ostream& out);
int measure_log_places(const LocalizationOptions& options, std::ostream& out);
int measure_search_speed(const LocalizationOptions& options, std::ostream& out);
int measure_tracking(const LocalizationOptions& options, std::ostream& out);
int measure_walls(const LocalizationOptions& options, std::ostream& out);
int measure_kidnaps(const LocalizationOptions& options, std::ostream& out);
int measure_changed_hall(const LocalizationOptions& options, std::ostream& out);

}  // namespace hybrid_slam
