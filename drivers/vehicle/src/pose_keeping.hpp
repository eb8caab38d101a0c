// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid_slam/vehicle/follower.hpp"

namespace hybrid_slam {

/// Brings the vehicle in `state` to now: by what was commanded or told since the last step, and by
/// a new pose.
void keep_pose(const VehicleConfig& vehicle, const FollowerConfig& config, FollowerState& state,
               const FollowerInput& input);

}  // namespace hybrid_slam
