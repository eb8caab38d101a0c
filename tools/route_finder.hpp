// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <future>
#include <memory>
#include <utility>

#include "hybrid_slam/pilot/pilot.hpp"
#include "hybrid_slam/vehicle/clearance.hpp"

namespace hybrid_slam::tools {

/// Finds the ways that a pilot asks for, beside the loop that drives.
class RouteFinder {
  public:
    /// `at_once`: where time stands meanwhile; the same then comes out each time.
    RouteFinder(std::shared_ptr<const ClearanceField> field, const VehicleConfig& vehicle,
                const PlannerConfig& config, bool at_once)
        : field_(std::move(field)), vehicle_(vehicle), config_(config), at_once_(at_once) {}

    /// In each cycle: begins what is wanted, and hands over what was found.
    void serve(Pilot& pilot);

  private:
    std::shared_ptr<const ClearanceField> field_;
    VehicleConfig vehicle_;
    PlannerConfig config_;
    bool at_once_;
    std::uint64_t number_ = 0;  ///< of the request that is worked on
    std::future<Route> route_;
};

}  // namespace hybrid_slam::tools
