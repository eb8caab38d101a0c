// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {

struct StampedPose {
    double stamp = 0.0;  ///< seconds
    Pose2d pose;         ///< map_from_robot
};

/// Poses in the order of driving. Stamps may run backwards or repeat, as they do in real logs.
using Trajectory = std::vector<StampedPose>;

/// Reads `stamp tx ty tz qx qy qz qw` lines (TUM); '#' starts a comment. Throws Error with the file
/// and the line on a line that is not eight numbers, and on a file without any pose.
Trajectory read_tum(const std::filesystem::path& file);

/// Writes one line per pose, stamps with six decimals. Throws Error when the file cannot be
/// written.
void write_tum(const std::filesystem::path& file, const Trajectory& trajectory);

/// Metres along the trajectory, in its own order; to and fro within 5 cm counts for nothing.
double length_of(const Trajectory& trajectory);

/// Looks poses up by stamp; the trajectory's own order does not matter.
class TrajectoryIndex {
  public:
    explicit TrajectoryIndex(const Trajectory& trajectory);

    /// The pose with the nearest stamp, if that is at most `tolerance` seconds away.
    std::optional<Pose2d> nearest(double stamp, double tolerance) const;

    /// The pose at the stamp, interpolated between its two neighbours; empty outside of the
    /// trajectory and inside of a gap longer than `max_gap` seconds.
    std::optional<Pose2d> interpolated(double stamp, double max_gap) const;

  private:
    std::vector<StampedPose> sorted_;
};

}  // namespace hybrid_slam
