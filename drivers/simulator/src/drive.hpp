// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hybrid_slam/core/pose2.hpp"
#include "hybrid_slam/simulator/world.hpp"

namespace hybrid_slam {

/// A motion with constant speed and turn rate: a straight line, an arc or a turn on the spot.
struct DrivePiece {
    Pose2d world_from_start;
    double speed = 0.0;      ///< m/s
    double turn_rate = 0.0;  ///< rad/s
    double start = 0.0;      ///< seconds since the start of the drive
    double duration = 0.0;   ///< seconds
};

/// Where the robot truly is at each time: along the path, its corners rounded as far as their legs
/// leave room, and turning on the spot where they are too sharp for that.
class Drive {
  public:
    /// Throws Error for a path of fewer than two different points.
    Drive(const World& world, double speed, double turn_rate);

    double duration() const;
    Pose2d world_from_robot(double time) const;  ///< clamped to the drive

  private:
    void add_straight(double length);
    void add_turn(double angle, double radius);
    void add_piece(double speed, double turn_rate, double seconds);

    double speed_;
    double turn_rate_;
    Pose2d world_from_robot_;  ///< at the end of the last piece
    std::vector<DrivePiece> pieces_;
};

}  // namespace hybrid_slam
