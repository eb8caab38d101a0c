// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "painter.hpp"

namespace hybrid_slam {
namespace {

constexpr Color kWhite{178.0F, 186.0F, 188.0F};
constexpr Color kMortar{120.0F, 126.0F, 130.0F};
constexpr Color kDark{45.0F, 46.0F, 48.0F};

/// Courses of `columns` x `rows` stones, every second one moved by half a stone.
Canvas masonry(Painter& painter, const Color& stone, int columns, int rows, float spread) {
    Canvas canvas = painter.canvas(kMortar);
    const float width = 1.0F / static_cast<float>(columns);
    const float height = 1.0F / static_cast<float>(rows);
    const float joint = 0.012F;
    for (int row = 0; row < rows; ++row) {
        const float y = static_cast<float>(row) * height;
        const float shift = row % 2 == 0 ? 0.0F : -0.5F * width;
        for (int column = 0; column <= columns; ++column) {
            const float x = static_cast<float>(column) * width + shift;
            const Color tone = stone * painter.between(1.0 - spread, 1.0 + spread);
            canvas.rectangle(x + 0.5F * joint, y + 0.5F * joint, x + width - 0.5F * joint,
                             y + height - 0.5F * joint, tone);
        }
    }
    painter.soil(canvas, 0.05F, 0.07F);
    return canvas;
}

Canvas brick(Painter& painter) {
    return masonry(painter, {78.0F, 92.0F, 150.0F}, 2, 6, 0.22F);
}

Canvas plain(Painter& painter) {
    Canvas canvas = painter.canvas(kWhite);
    painter.soil(canvas, 0.004F, 0.003F);
    return canvas;
}

Canvas panel(Painter& painter) {
    Canvas canvas = painter.canvas(Color{150.0F, 140.0F, 128.0F} * painter.between(0.97, 1.03));
    painter.soil(canvas, 0.02F, 0.012F);
    for (int rib = 0; rib < 3; ++rib) {
        const float x = static_cast<float>(rib) / 3.0F;
        canvas.paint_in(x, 0.0F, x + 0.025F, 1.0F,
                        [](float, float, Color& color) { color = color * 0.72F; });
        canvas.paint_in(x + 0.025F, 0.0F, x + 0.05F, 1.0F,
                        [](float, float, Color& color) { color = color * 1.12F; });
    }
    for (const float y : {0.12F, 0.62F}) {
        canvas.rectangle(0.16F, y, 0.175F, y + 0.015F, kDark);
        canvas.rectangle(0.5F, y, 0.515F, y + 0.015F, kDark);
    }
    for (int i = painter.below(3); i > 0; --i) {
        painter.scratch(canvas, painter.between(0.1, 0.5), painter.between(-0.3, 0.25));
    }
    return canvas;
}

/// A carton with its edges, a strip of tape and perhaps a label.
void carton(Painter& painter, Canvas& canvas, const Area& area) {
    const auto& [x0, y0, x1, y1] = area;
    const Color board = Color{88.0F, 124.0F, 158.0F} * painter.between(0.7, 1.15);
    canvas.rectangle(x0, y0, x1, y1, board * 0.5F);
    const float edge = 0.012F;
    canvas.rectangle(x0 + edge, y0 + edge, x1 - edge, y1 - edge, board);
    const float tape = 0.5F * (x0 + x1) + painter.between(-0.03, 0.03);
    canvas.rectangle(tape - 0.025F, y0 + edge, tape + 0.025F, y1 - edge, board * 1.2F);
    if (painter.random.uniform() < 0.6) {
        const float x = x0 + painter.between(0.08, 0.45) * area.width();
        const float y = y0 + painter.between(0.15, 0.45) * area.height();
        painter.print(canvas, {x, y, x + 0.38F * area.width(), y + 0.42F * area.height()});
    }
}

void stack(Painter& painter, Canvas& canvas, float y0, float y1) {
    const int columns = 1 + painter.below(3);
    const int rows = 1 + painter.below(2);
    const float width = 1.0F / static_cast<float>(columns);
    const float height = (y1 - y0) / static_cast<float>(rows);
    for (int i = 0; i < columns * rows; ++i) {
        const int row = i / columns;
        const float x = static_cast<float>(i % columns) * width;
        const float y = y0 + static_cast<float>(row) * height;
        carton(painter, canvas, {x, y, x + width, y + height * painter.between(0.9, 1.0)});
    }
}

Canvas cartons(Painter& painter) {
    Canvas canvas = painter.canvas(kDark);
    stack(painter, canvas, 0.0F, 1.0F);
    painter.soil(canvas, 0.04F, 0.04F);
    return canvas;
}

Canvas pallet(Painter& painter) {
    Canvas canvas = painter.canvas(kDark * 0.6F);
    const Color wood{84.0F, 118.0F, 150.0F};
    canvas.rectangle(0.0F, 0.02F, 1.0F, 0.06F, wood * 0.85F);
    canvas.rectangle(0.0F, 0.19F, 1.0F, 0.24F, wood);
    for (const float x : {0.0F, 0.42F, 0.86F}) {
        canvas.rectangle(x, 0.06F, x + 0.14F, 0.19F, wood * 0.75F);
    }
    stack(painter, canvas, 0.24F, 0.97F);
    painter.soil(canvas, 0.04F, 0.05F);
    return canvas;
}

Canvas beam(Painter& painter) {
    Canvas canvas = painter.canvas(kDark * 0.8F);
    stack(painter, canvas, 0.2F, 0.85F);
    canvas.rectangle(0.0F, 0.0F, 1.0F, 0.2F, {40.0F, 95.0F, 205.0F});
    for (int hole = 0; hole < 4; ++hole) {
        const float x = 0.1F + 0.25F * static_cast<float>(hole);
        canvas.rectangle(x, 0.07F, x + 0.04F, 0.13F, kDark);
    }
    painter.soil(canvas, 0.04F, 0.04F);
    return canvas;
}

/// Cell (column, row) of a double-leaf steel door, 2 x kDoorRows cells.
Canvas door_cell(Painter& painter, int column, int row) {
    Canvas canvas = painter.canvas({128.0F, 112.0F, 96.0F});
    const auto frame = [&canvas](float x0, float y0, float x1, float y1) {
        canvas.rectangle(x0, y0, x1, y1, {70.0F, 66.0F, 62.0F});
    };
    const float outer = column == 0 ? 0.0F : 0.9F;
    frame(outer, 0.0F, outer + 0.1F, 1.0F);
    const float inner = column == 0 ? 0.985F : 0.0F;
    frame(inner, 0.0F, inner + 0.015F, 1.0F);
    if (row == 0) {
        canvas.rectangle(0.1F, 0.03F, 0.9F, 0.3F, {150.0F, 150.0F, 148.0F});
    }
    if (row == 1 && column == 1) {
        canvas.rectangle(0.06F, 0.62F, 0.28F, 0.68F, {205.0F, 208.0F, 208.0F});
        canvas.rectangle(0.06F, 0.4F, 0.13F, 0.72F, {180.0F, 182.0F, 182.0F});
    }
    if (row == 2) {
        canvas.rectangle(0.3F, 0.2F, 0.7F, 0.9F, kDark);
        canvas.rectangle(0.33F, 0.23F, 0.67F, 0.87F, {150.0F, 140.0F, 120.0F});
    }
    if (row == kDoorRows - 1) {
        frame(0.0F, 0.5F, 1.0F, 0.62F);
        canvas.rectangle(0.0F, 0.62F, 1.0F, 1.0F, kWhite);
    }
    painter.soil(canvas, 0.02F, 0.012F);
    return canvas;
}

/// A sheet somewhere on the given ground.
Canvas with_sheet(Painter& painter, Canvas canvas) {
    const float x = painter.between(0.08, 0.3);
    const float y = painter.between(0.08, 0.25);
    const float width = painter.between(0.4, 0.62);
    const float height = painter.between(0.5, 0.7);
    canvas.rectangle(x - 0.02F, y - 0.02F, x + width + 0.02F, y + height + 0.02F, kDark);
    painter.print(canvas, {x, y, x + width, y + height});
    return canvas;
}

void paint_storage(Painter& painter, WallMaterials& walls) {
    for (int i = 0; i < 6; ++i) {
        walls.cartons.push_back(painter.atlas.add(cartons(painter)));
    }
    for (int i = 0; i < 4; ++i) {
        walls.pallets.push_back(painter.atlas.add(pallet(painter)));
        walls.beams.push_back(painter.atlas.add(beam(painter)));
    }
}

}  // namespace

WallMaterials paint_walls(Painter& painter) {
    WallMaterials walls;
    for (int i = 0; i < 4; ++i) {
        walls.brick.push_back(painter.atlas.add(brick(painter)));
        walls.plain.push_back(painter.atlas.add(plain(painter)));
        walls.signs.push_back(painter.atlas.add(with_sheet(painter, plain(painter))));
    }
    for (int i = 0; i < 3; ++i) {
        const Color stone{134.0F, 140.0F, 141.0F};
        walls.block.push_back(painter.atlas.add(masonry(painter, stone, 1, 2, 0.06F)));
        walls.panel.push_back(painter.atlas.add(panel(painter)));
        walls.posters.push_back(painter.atlas.add(with_sheet(painter, brick(painter))));
    }
    Canvas skirting = plain(painter);
    skirting.rectangle(0.0F, 0.0F, 1.0F, 0.16F, {88.0F, 90.0F, 92.0F});
    walls.skirting.push_back(painter.atlas.add(skirting));
    for (int i = 0; i < 2 * kDoorRows; ++i) {
        walls.door.push_back(painter.atlas.add(door_cell(painter, i / kDoorRows, i % kDoorRows)));
    }
    paint_storage(painter, walls);
    return walls;
}

Pictures paint_roof(Painter& painter) {
    Canvas dark = painter.canvas({62.0F, 60.0F, 58.0F});
    painter.soil(dark, 0.06F, 0.03F);
    Canvas beam_x = dark;
    beam_x.rectangle(0.0F, 0.35F, 1.0F, 0.65F, {104.0F, 100.0F, 96.0F});
    beam_x.rectangle(0.0F, 0.35F, 1.0F, 0.41F, {40.0F, 38.0F, 38.0F});
    beam_x.rectangle(0.0F, 0.35F, 0.1F, 0.65F, {70.0F, 66.0F, 64.0F});
    Canvas lamp = dark;
    lamp.rectangle(0.02F, 0.36F, 0.98F, 0.64F, {150.0F, 150.0F, 150.0F});
    lamp.rectangle(0.05F, 0.4F, 0.95F, 0.6F, {255.0F, 255.0F, 255.0F});
    return {painter.atlas.add(dark), painter.atlas.add(beam_x), painter.atlas.add(lamp)};
}

}  // namespace hybrid_slam
