// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace hybrid_slam {

/// Seconds since the computer started, of a clock that nobody sets.
inline double steady_seconds() {
    const auto since_boot = std::chrono::steady_clock::now().time_since_epoch();
    return std::chrono::duration<double>(since_boot).count();
}

/// Wall-clock seconds since it was made. For reports; no decision may depend on it.
class Stopwatch {
  public:
    double seconds() const { return steady_seconds() - start_; }

  private:
    double start_ = steady_seconds();
};

}  // namespace hybrid_slam
