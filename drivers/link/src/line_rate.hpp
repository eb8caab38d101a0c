// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

namespace hybrid_slam {

/// A bucket that fills with `per_second` and holds as much as one second gives.
class LineRate {
  public:
    explicit LineRate(double per_second) : per_second_(per_second), left_(per_second) {}

    bool allows_one(double now) {
        left_ = std::min(per_second_, left_ + per_second_ * std::max(0.0, now - last_));
        last_ = now;
        if (left_ < 1.0) {
            return false;
        }
        left_ -= 1.0;
        return true;
    }

  private:
    double per_second_;
    double left_;
    double last_ = 0.0;
};

}  // namespace hybrid_slam
