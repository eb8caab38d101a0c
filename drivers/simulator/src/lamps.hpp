// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace hybrid_slam {

/// The lamps below the ceiling, one in the middle of each square of 4.8 m, some of them dead. The
/// pattern repeats after kEachWay of them.
class Lamps {
  public:
    static constexpr int kEachWay = 8;
    static constexpr double kSpacing = 4.8;  ///< metres

    Lamps(double ceiling_height, std::uint64_t seed);

    /// Counted from the world's origin; may be negative.
    bool is_lit(int column, int row) const;

    /// The light at a place, about 1 on average; smooth.
    float light(float x, float y) const;

    /// What of a lamp a dull mirror shows at this place of the ceiling: 1 in a lamp's middle.
    float glint(float x, float y) const;

  private:
    static constexpr int kNodes = 64;  ///< each way, over the whole pattern

    double sum_of_lamps(double x, double y, double height) const;

    std::vector<bool> lit_;
    std::vector<float> nodes_;
};

}  // namespace hybrid_slam
