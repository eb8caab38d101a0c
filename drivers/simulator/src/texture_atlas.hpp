// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "canvas.hpp"

namespace hybrid_slam {

/// Three channels of 8 bits in fields of 10, blue lowest, so that four texels can be summed as
/// plain numbers.
using Texel = std::uint32_t;

inline constexpr unsigned kFieldBits = 10;
inline constexpr Texel kFieldMask = (1U << kFieldBits) - 1U;
/// Shows what is behind; no sum of fields reaches it.
inline constexpr Texel kTransparent = 0xFFFFFFFFU;

/// Pictures of one cell each (a tile of the floor, a piece of a wall), with all their mipmaps.
class TextureAtlas {
  public:
    /// Level 0 of each picture has 2^side_bits texels to a side; room is made for so many pictures.
    TextureAtlas(int side_bits, std::size_t pictures);

    int side_bits() const { return side_bits_; }
    int side() const { return 1 << side_bits_; }

    /// The number of the picture. Negative blue marks transparent texels.
    std::uint16_t add(const Canvas& canvas);

    /// All pictures, each 2^(side_bits - level) texels to a side, one behind the other.
    const Texel* level(int level) const { return levels_[static_cast<std::size_t>(level)].data(); }

  private:
    void add_next_level(std::size_t level, std::size_t pictures_before);

    int side_bits_;
    std::uint16_t pictures_ = 0;
    std::vector<std::vector<Texel>> levels_;
};

}  // namespace hybrid_slam
