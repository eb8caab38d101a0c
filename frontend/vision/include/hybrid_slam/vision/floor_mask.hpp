// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hybrid_slam/core/measurements.hpp"

namespace hybrid_slam {

/// Which pixels of an image show floor.
struct FloorMask {
    int width = 0;
    int height = 0;
    std::vector<std::uint8_t> is_floor;  ///< width * height, rows top to bottom: 0 or 1
};

/// Tells floor from everything else by the looks of an image alone.
class FloorSegmenter {
  public:
    FloorSegmenter() = default;
    FloorSegmenter(const FloorSegmenter&) = delete;
    FloorSegmenter& operator=(const FloorSegmenter&) = delete;
    virtual ~FloorSegmenter() = default;

    /// A mask as large as the image, which comes in gray and as bright as the one before.
    virtual FloorMask segment(const Image& image) = 0;
};

}  // namespace hybrid_slam
