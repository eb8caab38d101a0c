// SPDX-License-Identifier: Apache-2.0
#include "texture_atlas.hpp"

#include <algorithm>
#include <array>

namespace hybrid_slam {
namespace {

Texel field(float value) {
    return static_cast<Texel>(std::clamp(value, 0.0F, 255.0F) + 0.5F);
}

Texel packed(const Color& color) {
    if (color.b < 0.0F) {
        return kTransparent;
    }
    return field(color.b) | field(color.g) << kFieldBits | field(color.r) << (2 * kFieldBits);
}

/// Of the opaque ones; transparent when these are fewer than half.
Texel mean_of(const std::array<Texel, 4>& texels) {
    Texel sum = 0;
    Texel opaque = 0;
    for (const Texel texel : texels) {
        if (texel != kTransparent) {
            sum += texel;
            ++opaque;
        }
    }
    if (opaque < 2) {
        return kTransparent;
    }
    Texel mean = 0;
    for (unsigned shift = 0; shift < 3 * kFieldBits; shift += kFieldBits) {
        mean |= ((((sum >> shift) & kFieldMask) + opaque / 2) / opaque) << shift;
    }
    return mean;
}

}  // namespace

TextureAtlas::TextureAtlas(int side_bits, std::size_t pictures)
    : side_bits_(side_bits), levels_(static_cast<std::size_t>(side_bits) + 1) {
    std::size_t texels = pictures << (2 * static_cast<std::size_t>(side_bits));
    for (std::vector<Texel>& level : levels_) {
        level.reserve(texels);
        texels /= 4;
    }
}

std::uint16_t TextureAtlas::add(const Canvas& canvas) {
    std::vector<Texel>& finest = levels_.front();
    for (int y = 0; y < side(); ++y) {
        for (int x = 0; x < side(); ++x) {
            finest.push_back(packed(canvas.at(x, y)));
        }
    }
    for (std::size_t level = 1; level < levels_.size(); ++level) {
        add_next_level(level, pictures_);
    }
    return pictures_++;
}

void TextureAtlas::add_next_level(std::size_t level, std::size_t pictures_before) {
    const std::size_t side = std::size_t{1} << (static_cast<std::size_t>(side_bits_) - level);
    const Texel* finer = levels_[level - 1].data() + pictures_before * 4 * side * side;
    for (std::size_t y = 0; y < side; ++y) {
        const Texel* low = finer + 4 * y * side;
        const Texel* high = low + 2 * side;
        for (std::size_t x = 0; x < side; ++x) {
            levels_[level].push_back(
                mean_of({low[2 * x], low[2 * x + 1], high[2 * x], high[2 * x + 1]}));
        }
    }
}

}  // namespace hybrid_slam
