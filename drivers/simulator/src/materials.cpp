// SPDX-License-Identifier: Apache-2.0
#include "materials.hpp"

#include <cmath>

#include "hash.hpp"
#include "painter.hpp"

namespace hybrid_slam {

Painter::Painter(TextureAtlas& atlas_in, const RenderConfig& config, std::uint64_t seed)
    : atlas(atlas_in),
      dirt(static_cast<float>(config.dirt)),
      tile(static_cast<float>(config.floor_tile)),
      random(hash(seed, 1)),
      clouds(atlas_in.side(), 4, 4, 0.6F, hash(seed, 2)),
      grain(atlas_in.side(), 64, 2, 0.7F, hash(seed, 3)) {}

Canvas Painter::canvas(const Color& color) const {
    Canvas made(atlas.side());
    made.fill(color);
    return made;
}

void Painter::soil(Canvas& canvas, float blotches, float fine) {
    const int side = canvas.side();
    canvas.modulate(clouds, dirt * blotches, below(side), below(side));
    canvas.modulate(grain, dirt * fine, below(side), below(side));
}

void Painter::scratch(Canvas& canvas, float length, float strength) {
    const auto side = static_cast<float>(canvas.side());
    float x = between(0.05, 0.95) * side;
    float y = between(0.05, 0.95) * side;
    float angle = between(0.0, 2.0 * kPi);
    const float bend = between(-0.01, 0.01);
    const auto steps = static_cast<int>(length * side);
    for (int step = 0; step < steps; ++step) {
        x += std::cos(angle);
        y += std::sin(angle);
        angle += bend;
        const auto column = static_cast<int>(x);
        const auto row = static_cast<int>(y);
        if (column < 0 || row < 0 || column + 1 >= canvas.side() || row + 1 >= canvas.side()) {
            return;
        }
        for (Color* color : {&canvas.at(column, row), &canvas.at(column + 1, row)}) {
            *color = *color * (1.0F + dirt * strength);
        }
    }
}

void Painter::print(Canvas& canvas, const Area& sheet) {
    const auto tone = [this] {
        return Color{between(20, 230), between(20, 230), between(20, 230)};
    };
    const auto& [x0, y0, x1, y1] = sheet;
    const float width = sheet.width();
    const float height = sheet.height();
    canvas.rectangle(x0, y0, x1, y1, {225.0F, 228.0F, 230.0F});
    const float head = y1 - between(0.15, 0.35) * height;
    canvas.rectangle(x0, head, x1, y1, tone());
    const int blocks = 2 + below(4);
    for (int i = 0; i < blocks; ++i) {
        const float x = x0 + between(0.05, 0.6) * width;
        const float y = y0 + between(0.05, 0.5) * height;
        canvas.rectangle(x, y, std::min(x + between(0.1, 0.4) * width, x1),
                         std::min(y + between(0.1, 0.3) * height, head), tone());
    }
    const Color ink{40.0F, 35.0F, 35.0F};
    for (int line = 0; line < 6; ++line) {
        const float y = head - (0.06F + 0.08F * static_cast<float>(line)) * height;
        for (float x = x0 + 0.06F * width; x < x1 - 0.15F * width; x += between(0.05, 0.15)) {
            const float end = std::min(x + between(0.02, 0.09), x1 - 0.05F * width);
            canvas.rectangle(x, y, end, y + 0.035F * height, ink);
        }
    }
}

Materials paint_materials(TextureAtlas& atlas, const RenderConfig& config, std::uint64_t seed) {
    Painter painter(atlas, config, seed);
    Materials materials;
    materials.floor = paint_floor(painter);
    materials.walls = paint_walls(painter);
    materials.roof = paint_roof(painter);
    materials.people = paint_people(painter);
    materials.haze = atlas.add(painter.canvas({92.0F, 90.0F, 86.0F}));
    return materials;
}

}  // namespace hybrid_slam
