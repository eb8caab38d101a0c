// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {

/// Seeded random numbers that do not depend on the standard library: its distributions differ from
/// one to the next, while mt19937_64 is specified to the bit.
class Noise {
  public:
    explicit Noise(std::uint64_t seed) : engine_(seed) {}

    /// In (0, 1].
    double uniform() {
        constexpr double kStep = 1.0 / 9007199254740992.0;  // 2^-53
        return static_cast<double>((engine_() >> 11U) + 1U) * kStep;
    }

    /// Mean 0 and standard deviation 1, by Box and Muller 1958.
    double gauss() {
        if (has_spare_) {
            has_spare_ = false;
            return spare_;
        }
        const double radius = std::sqrt(-2.0 * std::log(uniform()));
        const double angle = 2.0 * kPi * uniform();
        spare_ = radius * std::sin(angle);
        has_spare_ = true;
        return radius * std::cos(angle);
    }

  private:
    std::mt19937_64 engine_;
    double spare_ = 0.0;
    bool has_spare_ = false;
};

}  // namespace hybrid_slam
