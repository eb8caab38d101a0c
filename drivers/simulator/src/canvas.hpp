// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace hybrid_slam {

/// Gray levels 0 to 255.
struct Color {
    float b = 0.0F;
    float g = 0.0F;
    float r = 0.0F;
};

inline Color operator*(const Color& color, float scale) {
    return {color.b * scale, color.g * scale, color.r * scale};
}
inline Color blend(const Color& from, const Color& to, float share) {
    return {from.b + share * (to.b - from.b), from.g + share * (to.g - from.g),
            from.r + share * (to.r - from.r)};
}

/// Square random pattern of mean 0 and standard deviation 1 that goes on seamlessly at its edges.
/// The side is a power of two.
class Pattern {
  public:
    /// Sum of value noise of `octaves` lattices from `lattice` points to a side on, each finer by
    /// two and weaker by `fade`.
    Pattern(int side, int lattice, int octaves, float fade, std::uint64_t seed);

    float at(int x, int y) const {
        return values_[static_cast<std::size_t>(((y & mask_) * (mask_ + 1)) + (x & mask_))];
    }

  private:
    void add_octave(int lattice, float weight, std::uint64_t seed);
    void normalize();

    int mask_ = 0;
    std::vector<float> values_;
};

/// A square picture of one cell: x to the right, y up (walls) or along the world's y (floor).
class Canvas {
  public:
    explicit Canvas(int side) : side_(side), colors_(static_cast<std::size_t>(side * side)) {}

    int side() const { return side_; }
    Color& at(int x, int y) { return colors_[static_cast<std::size_t>(y * side_ + x)]; }
    const Color& at(int x, int y) const { return colors_[static_cast<std::size_t>(y * side_ + x)]; }

    /// Calls paint(x, y, color) for each texel; x and y in (0, 1).
    template <typename Paint>
    void paint(const Paint& paint) {
        paint_in(0.0F, 0.0F, 1.0F, 1.0F, paint);
    }
    /// The same for the texels of a rectangle, all in (0, 1).
    template <typename Paint>
    void paint_in(float x0, float y0, float x1, float y1, const Paint& paint) {
        const auto size = static_cast<float>(side_);
        const float step = 1.0F / size;
        const int first_y = std::max(static_cast<int>(y0 * size), 0);
        const int last_y = std::min(static_cast<int>(y1 * size), side_);
        const int first_x = std::max(static_cast<int>(x0 * size), 0);
        const int last_x = std::min(static_cast<int>(x1 * size), side_);
        for (int y = first_y; y < last_y; ++y) {
            for (int x = first_x; x < last_x; ++x) {
                paint((static_cast<float>(x) + 0.5F) * step, (static_cast<float>(y) + 0.5F) * step,
                      at(x, y));
            }
        }
    }
    void fill(const Color& color) { std::fill(colors_.begin(), colors_.end(), color); }
    void rectangle(float x0, float y0, float x1, float y1, const Color& color) {
        paint_in(x0, y0, x1, y1, [&color](float, float, Color& texel) { texel = color; });
    }
    /// Scales the brightness by 1 + strength * pattern, the pattern moved by (dx, dy) texels.
    void modulate(const Pattern& pattern, float strength, int dx, int dy);

  private:
    int side_;
    std::vector<Color> colors_;
};

}  // namespace hybrid_slam
