// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace hybrid_slam {

/// A moment some seconds from now.
class Deadline {
  public:
    explicit Deadline(double seconds)
        : end_(Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                  std::chrono::duration<double>(bounded(seconds)))) {}

    double left() const {  ///< seconds, never negative
        return std::max(0.0, std::chrono::duration<double>(end_ - Clock::now()).count());
    }
    bool passed() const { return Clock::now() >= end_; }

    /// Waits until the descriptor has something to read, or an error; false when the time is over.
    bool wait_for(int descriptor) const {
        pollfd state{descriptor, POLLIN, 0};
        const double seconds = left();
        // In whole milliseconds, up: a wait that ends early would be repeated without a pause.
        return poll(&state, 1, static_cast<int>(std::ceil(seconds * 1000.0))) > 0;
    }

  private:
    /// What poll and the clock can count; NaN is no time.
    static double bounded(double seconds) {
        constexpr double kMost = 1e6;
        return seconds > 0.0 ? std::min(seconds, kMost) : 0.0;
    }

    using Clock = std::chrono::steady_clock;
    Clock::time_point end_;
};

}  // namespace hybrid_slam
