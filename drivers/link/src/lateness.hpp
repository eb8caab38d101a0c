// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <limits>

namespace hybrid_slam {

/// How much later a message came than the promptest lately. The differences of arrival and stamp
/// hold the unknown offset of two clocks, which their least value takes out; since clocks drift
/// (50 ppm are 3 ms in a minute), that is the least of the last half to whole minute.
class Lateness {
  public:
    double of(double stamp, double arrival) {
        const double delay = arrival - stamp;
        if (arrival >= turn_) {
            // After a long silence what was known before holds still, but for what clocks drift.
            before_ = least_ + kDrift * std::max(0.0, arrival - turn_);
            least_ = kNone;
            turn_ = arrival + kHalf;
        }
        least_ = std::min(least_, delay);
        return delay - std::min(before_, least_);
    }

  private:
    static constexpr double kHalf = 30.0;   // seconds
    static constexpr double kDrift = 1e-4;  // seconds in a second
    static constexpr double kNone = std::numeric_limits<double>::infinity();
    double turn_ = -kNone;   ///< arrival from which a new half minute starts
    double least_ = kNone;   ///< of this half minute
    double before_ = kNone;  ///< of the one before
};

}  // namespace hybrid_slam
