// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "leg_search.hpp"

namespace hybrid_slam {

/// The same leg with detours between places of it replaced by Reeds-Shepp ways where those are
/// cheaper: what a search over few steering angles leaves crooked becomes straight.
Arcs with_shortcuts(const DrivingCost& driving, const DrivingState& start, const Waypoint& goal,
                    const Arcs& arcs);

}  // namespace hybrid_slam
