// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>

#include "benchmarks.hpp"
#include "navigation/closed_loop.hpp"

namespace hybrid_slam {

// Each prints what was measured beside what is asked and what the thesis had, and returns how many
// figures miss.
int measure_tables(const NavigationOptions& options, const test::LoopMap& map, std::ostream& out);
int measure_random_trips(const NavigationOptions& options, const test::LoopMap& map,
                         std::ostream& out);
int measure_faults(const NavigationOptions& options, const test::LoopMap& map, std::ostream& out);
int measure_latency(const NavigationOptions& options, const test::LoopMap& map, std::ostream& out);

}  // namespace hybrid_slam
