// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {

/// Cuts the poses into bins of equal size in x, y and heading.
class PoseBins {
  public:
    using Key = std::uint64_t;

    /// Metres and radians; the angle is made a whole part of a turn.
    PoseBins(double size, double angle);

    Key key_of(const Pose2d& pose) const;
    /// Of a bin and the 26 around it, those that come before it in a fixed order. Headings close a
    /// circle, so that with few bins some are named twice.
    void earlier_neighbors(Key key, std::vector<Key>& neighbors) const;

  private:
    double size_;
    std::int64_t headings_;
};

/// Gives each pose the number of its cluster: bins that touch, also by a corner, are one. Clusters
/// are numbered in the order of their first poses.
struct Clusters {
    std::vector<std::uint32_t> of_pose;
    std::size_t count = 0;
};
Clusters clusters_of(const std::vector<Pose2d>& poses, const PoseBins& bins);

}  // namespace hybrid_slam
