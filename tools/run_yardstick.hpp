// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

#include "evaluation.hpp"
#include "hybrid_slam/core/trajectory.hpp"
#include "localization_report.hpp"

namespace hybrid_slam::tools {

/// Holds the poses of a localization against the truth.
class RunYardstick {
  public:
    /// Reads all files, so that a wrong name costs no drive. With `map_truth`, the truth of the
    /// drive that the map was made of, the frame of the map is tied to that of the truth: a map
    /// made of a drive whose truth is known lies where that puts it. Throws Error.
    RunYardstick(const YardstickFiles& files, const std::filesystem::path& map,
                 const std::filesystem::path& map_truth);

    /// Throws Error when they have nothing in common.
    RunTruth measure(const Trajectory& trajectory) const;

  private:
    std::optional<Pose2d> truth_from_map_;
    Yardstick yardstick_;
    std::string how_;
};

}  // namespace hybrid_slam::tools
