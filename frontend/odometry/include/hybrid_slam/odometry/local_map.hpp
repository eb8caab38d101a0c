// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/registration/surface.hpp"

namespace hybrid_slam {

struct LocalMapConfig {
    int scans = 15;            ///< the newest so many are the map
    double resolution = 0.05;  ///< metres; points of several scans in one cell are averaged
};

void describe(ConfigSchema& schema, LocalMapConfig& config);

/// The surfaces seen lately, merged into one reference for ICP. Rebuilt only by insert.
class LocalMap {
  public:
    explicit LocalMap(const LocalMapConfig& config) : config_(config) {}

    /// Adds a surface given in the frame of the map, and forgets the oldest beyond `scans`.
    void insert(Surface surface_in_map);

    /// Empty before the first insert of any point.
    const std::optional<Reference>& reference() const { return reference_; }

  private:
    LocalMapConfig config_;
    std::deque<Surface> surfaces_;
    std::optional<Reference> reference_;
};

/// One surface of many: points in the same cell and facing the same side are averaged, with their
/// normals. Deterministic: the order follows the input.
Surface merge(const std::deque<Surface>& surfaces, double resolution);

}  // namespace hybrid_slam
