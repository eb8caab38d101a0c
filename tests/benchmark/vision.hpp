// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>

#include "vision_drive.hpp"

namespace hybrid_slam {

// The topics of `vision`. Each prints what was measured beside what is asked, and returns how many
// figures miss.

/// The thesis's hall, with all scans: the accuracy of every way, and of VO alone.
int measure_hall(const VisionOptions& options, std::ostream& out);

/// The same with every sixth scan alone and fast turns.
int measure_slow_loop(const VisionOptions& options, std::ostream& out);

/// How far along a corridor without features one seems to have come.
int measure_corridor(const VisionOptions& options, std::ostream& out);

/// A covered camera, half the light, a person in the way.
int measure_faults(const VisionOptions& options, std::ostream& out);

/// Real images of a car; skipped when they are absent.
int measure_kitti(const VisionOptions& options, std::ostream& out);

/// Images per second on one core.
int measure_vision_speed(const VisionOptions& options, std::ostream& out);

}  // namespace hybrid_slam
