// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "canvas.hpp"
#include "hybrid_slam/simulator/render_config.hpp"
#include "materials.hpp"
#include "noise.hpp"
#include "texture_atlas.hpp"

namespace hybrid_slam {

/// Part of a canvas, in (0, 1).
struct Area {
    float x0, y0, x1, y1;

    float width() const { return x1 - x0; }
    float height() const { return y1 - y0; }
};

/// What all painting shares: the atlas, the random numbers and the patterns of dirt.
struct Painter {
    Painter(TextureAtlas& atlas_in, const RenderConfig& config, std::uint64_t seed);

    float between(double low, double high) {
        return static_cast<float>(low + (high - low) * random.uniform());
    }
    int below(int count) { return std::min(static_cast<int>(random.uniform() * count), count - 1); }
    Canvas canvas(const Color& color) const;
    /// Large blotches and fine grain, each anew placed.
    void soil(Canvas& canvas, float blotches, float fine);
    /// A straight thin line of the length anywhere, brighter or darker by the strength.
    void scratch(Canvas& canvas, float length, float strength);
    /// Coloured blocks and lines of "text" on a white sheet.
    void print(Canvas& canvas, const Area& sheet);

    TextureAtlas& atlas;
    float dirt;
    float tile;  ///< metres
    Noise random;
    Pattern clouds;
    Pattern grain;
};

FloorMaterials paint_floor(Painter& painter);
WallMaterials paint_walls(Painter& painter);
Pictures paint_roof(Painter& painter);
std::vector<Pictures> paint_people(Painter& painter);

}  // namespace hybrid_slam
