// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hybrid_slam/core/measurements.hpp"
#include "looks.hpp"

namespace hybrid_slam {

/// The sensor: turns the light of the pixels into noisy bytes.
class Film {
  public:
    Film(int width, double noise_sigma, std::uint64_t seed);

    /// Begins an image, whose noise depends on the seed and this number alone.
    void expose(std::uint64_t frame, int height);

    /// The pixels of one block from (column, row) on; what reaches out of the image is left out.
    void develop(const BlockLight& light, int column, int row, Image& image) const;

  private:
    static constexpr std::size_t kChannels = 3;
    static constexpr std::uint64_t kDraws = 1U << 15U;

    double noise_sigma_;
    std::uint64_t seed_;
    std::vector<float> noise_;           ///< kDraws and another row
    std::vector<std::uint32_t> starts_;  ///< in noise_, of each row and channel
};

}  // namespace hybrid_slam
