// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "hash.hpp"
#include "painter.hpp"

namespace hybrid_slam {
namespace {

constexpr Color kTile{124.0F, 131.0F, 134.0F};
constexpr Color kConcrete{121.0F, 126.0F, 127.0F};
constexpr Color kGloss{104.0F, 116.0F, 106.0F};
constexpr Color kLine{45.0F, 175.0F, 205.0F};
constexpr Color kJoint{58.0F, 60.0F, 62.0F};
constexpr float kHalfJoint = 0.003F;  ///< metres

/// Chips of stone: what a webcam sees as speckle.
void sprinkle(Painter& painter, Canvas& canvas) {
    const auto side = static_cast<float>(canvas.side());
    const int dx = painter.below(canvas.side());
    const int dy = painter.below(canvas.side());
    canvas.paint([&](float x, float y, Color& color) {
        const float chip =
            painter.grain.at(static_cast<int>(x * side) + dx, static_cast<int>(y * side) + dy);
        if (chip > 1.75F) {
            color = color * std::max(1.0F - 0.3F * painter.dirt, 0.1F);
        } else if (chip < -1.85F) {
            color = color * (1.0F + 0.2F * painter.dirt);
        }
    });
}

void stain(Painter& painter, Canvas& canvas, float radius, float strength) {
    const float x0 = painter.between(radius, 1.0 - radius);
    const float y0 = painter.between(radius, 1.0 - radius);
    const float length = painter.between(0.5, 1.0) * radius;
    const auto side = static_cast<float>(canvas.side());
    canvas.paint([&](float x, float y, Color& color) {
        const float dx = (x - x0) / radius;
        const float dy = (y - y0) / length;
        const float ragged =
            0.25F * painter.clouds.at(static_cast<int>(x * side), static_cast<int>(y * side));
        const float squared = dx * dx + dy * dy + ragged;
        if (squared < 1.0F) {
            color = color * (1.0F - painter.dirt * strength * std::min(1.0F - squared, 0.7F));
        }
    });
}

/// The joint lies half on each of two neighbours.
void frame_with_joint(const Painter& painter, Canvas& canvas) {
    const auto side = static_cast<float>(canvas.side());
    const float half = std::max(kHalfJoint / painter.tile * side, 1.0F);  // texels
    canvas.paint([&](float x, float y, Color& color) {
        const float edge = side * std::min(std::min(x, 1.0F - x), std::min(y, 1.0F - y));
        color = blend(kJoint, color, std::clamp(edge - half + 0.5F, 0.0F, 1.0F));
    });
}

Canvas tile(Painter& painter) {
    const float shade = 1.0F + painter.dirt * painter.between(-0.14, 0.14);
    Canvas canvas = painter.canvas(kTile * shade);
    painter.soil(canvas, 0.07F, 0.05F);
    sprinkle(painter, canvas);
    for (int i = painter.below(5); i > 0; --i) {
        painter.scratch(canvas, painter.between(0.1, 0.6), painter.between(-0.25, 0.2));
    }
    if (painter.below(4) == 0) {
        stain(painter, canvas, painter.between(0.03, 0.15), painter.between(0.05, 0.3));
    }
    return canvas;
}

/// Cell (cx, cy) of a floor that is one seamless pattern.
Canvas concrete(const Painter& painter, const Pattern& blotches, int cx, int cy) {
    Canvas canvas = painter.canvas(kConcrete);
    const int side = canvas.side();
    canvas.paint([&](float x, float y, Color& color) {
        const int column = cx * side + static_cast<int>(x * static_cast<float>(side));
        const int row = cy * side + static_cast<int>(y * static_cast<float>(side));
        color = color * (1.0F + painter.dirt * 0.03F * blotches.at(column, row));
    });
    canvas.modulate(painter.grain, painter.dirt * 0.008F, 0, 0);
    return canvas;
}

/// A painted line of 10 cm in the middle of the cell, worn off in places.
void paint_line(Painter& painter, Canvas& canvas, bool along_x) {
    const float half = 0.05F / painter.tile;
    const auto side = static_cast<float>(canvas.side());
    const int shift = painter.below(canvas.side());
    canvas.paint([&](float x, float y, Color& color) {
        const auto column = static_cast<int>(x * side);
        const auto row = static_cast<int>(y * side) + shift;
        const float wear = painter.dirt * (0.6F * painter.grain.at(column, row) +
                                           0.7F * painter.clouds.at(column, row));
        if (std::abs((along_x ? y : x) - 0.5F) < half && wear < 1.3F) {
            color = blend(color, kLine, 0.85F);
        }
    });
}

void paint_drain(Canvas& canvas) {
    canvas.rectangle(0.2F, 0.2F, 0.8F, 0.8F, {95.0F, 98.0F, 100.0F});
    for (int slot = 0; slot < 7; ++slot) {
        const float x = 0.25F + 0.075F * static_cast<float>(slot);
        canvas.rectangle(x, 0.25F, x + 0.04F, 0.75F, {22.0F, 22.0F, 24.0F});
    }
}

void paint_tape(Painter& painter, Canvas& canvas) {
    const Color color{painter.between(30, 220), painter.between(30, 220), painter.between(60, 220)};
    canvas.rectangle(0.15F, 0.45F, 0.85F, 0.55F, color);
    canvas.rectangle(0.45F, 0.15F, 0.55F, 0.85F, color);
}

Pictures paint_marks(Painter& painter) {
    Pictures marks;
    for (int i = 0; i < 5; ++i) {
        Canvas canvas = tile(painter);
        frame_with_joint(painter, canvas);
        if (i == 0) {
            paint_drain(canvas);
        } else if (i == 1) {
            paint_tape(painter, canvas);
        } else {
            stain(painter, canvas, painter.between(0.15, 0.3), painter.between(0.4, 0.7));
        }
        marks.push_back(painter.atlas.add(canvas));
    }
    return marks;
}

}  // namespace

FloorMaterials paint_floor(Painter& painter) {
    FloorMaterials floor;
    for (int i = 0; i < 24; ++i) {
        Canvas canvas = tile(painter);
        frame_with_joint(painter, canvas);
        floor.tiles.push_back(painter.atlas.add(canvas));
    }
    const Pattern blotches(kConcreteCells * painter.atlas.side(), 8, 4, 0.5F,
                           hash(static_cast<std::uint64_t>(painter.below(1 << 20))));
    for (int i = 0; i < kConcreteCells * kConcreteCells; ++i) {
        const Canvas canvas = concrete(painter, blotches, i % kConcreteCells, i / kConcreteCells);
        floor.concrete.push_back(painter.atlas.add(canvas));
    }
    for (int i = 0; i < 2; ++i) {
        Canvas gloss = painter.canvas(kGloss);
        painter.soil(gloss, 0.006F, 0.004F);
        floor.gloss.push_back(painter.atlas.add(gloss));
        for (const bool along_x : {true, false}) {
            Canvas canvas = concrete(painter, blotches, i, along_x ? 0 : 1);
            paint_line(painter, canvas, along_x);
            (along_x ? floor.lines_x : floor.lines_y).push_back(painter.atlas.add(canvas));
        }
    }
    floor.marks = paint_marks(painter);
    return floor;
}

}  // namespace hybrid_slam
