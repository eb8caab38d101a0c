// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <unordered_map>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/core/measurements.hpp"
#include "hybrid_slam/core/occupancy_grid.hpp"
#include "hybrid_slam/core/points.hpp"
#include "hybrid_slam/vehicle/forklift.hpp"

namespace hybrid_slam {

struct SurroundingsConfig {
    double reach = 5.0;      ///< metres around the robot
    double remember = 30.0;  ///< seconds that what went out of sight is kept
    double margin = 0.05;    ///< metres to each side of the vehicle that must be free as well
    /// Whether the vehicle may go where neither the scanner sees nor anything was seen.
    bool trust_blind_area = true;
};

/// Lists the keys without a section before them.
void describe(ConfigSchema& schema, SurroundingsConfig& config);

/// What is in the way near a vehicle: the returns of the newest scan and, where that does not look
/// (behind a scanner with 270 degrees of view, in its blind sectors, behind what is nearer), what
/// earlier scans saw there and the walls of the map. What comes into such a place unseen is not
/// known here.
class Surroundings {
  public:
    explicit Surroundings(const SurroundingsConfig& config) : config_(config) {}

    /// The newest scan, and where it was taken. Stamps go on.
    void see(const Scan& scan, const Pose2d& map_from_robot);
    /// Poses were wrong by this much: what is remembered moves along.
    void correct(const Pose2d& new_map_from_old_map);

    /// Whether the newest scan looks to where the vehicle goes when it backs out straight.
    bool sees_behind(const VehicleConfig& vehicle) const;
    /// In the robot's frame at the newest scan.
    Points obstacles() const;
    /// The same and, where the scan does not look, occupied cells of the map.
    Points obstacles(const StateGrid& map) const;

  private:
    /// What a scan says of one place: whether it looked at it, or past it.
    bool looks_at(const Point2& in_robot) const;
    void remember_returns();
    void drop_what_is_seen();

    SurroundingsConfig config_;
    Scan scan_;
    Pose2d map_from_robot_;
    Points returns_;                                   ///< robot's frame
    std::unordered_map<std::int64_t, double> memory_;  ///< cells of the map: stamp when last seen
};

}  // namespace hybrid_slam
