// SPDX-License-Identifier: Apache-2.0
#include "map_backdrop.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr Color kWall{70, 76, 88};

}  // namespace

void draw_map(Canvas& canvas, const View& view, const ReferenceMap& map) {
    const StateGrid& grid = map.grid();
    if (grid.origin_yaw != 0.0) {
        for (const Pixel& pixel : view(map.surface().points)) {
            canvas.disc(pixel, 1.3, kWall);
        }
        return;
    }
    const GridGeometry& geometry = grid.geometry;
    const GridShades shades;
    canvas.fill({0, 0, canvas.width(), canvas.height()}, shades.unknown);
    const Point2 corner = geometry.origin + Point2(0.0, geometry.height * geometry.resolution);
    canvas.grid(grid, view(corner), view.pixels_per_metre() * geometry.resolution, shades);
}

}  // namespace hybrid_slam::tools
