// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "hybrid_slam/core/stopwatch.hpp"

namespace hybrid_slam::tools {

/// Seconds of the parts of a run that come once per scan.
struct StageTime {
    std::size_t count = 0;
    double total = 0.0;
    double longest = 0.0;

    void add(double seconds);
    double mean() const { return count == 0 ? 0.0 : total / static_cast<double>(count); }
};

/// Seconds of processor time that this process has used, all threads together.
double cpu_seconds();

/// The most memory (resident set) that this process has used since its start, or since
/// reset_peak_memory where the system can do that.
double peak_memory_mb();
void reset_peak_memory();

}  // namespace hybrid_slam::tools
