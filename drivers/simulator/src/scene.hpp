// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hybrid_slam/simulator/render_config.hpp"
#include "hybrid_slam/simulator/world.hpp"
#include "lamps.hpp"
#include "texture_atlas.hpp"

namespace hybrid_slam {

inline constexpr double kPersonHeight = 1.75;  ///< metres
inline constexpr double kRoofCell = 1.2;       ///< metres
inline constexpr int kFloorBits = 8;           ///< the floor repeats after 2^8 tiles

/// Which picture is in which cell of a surface: rows of 2^u_bits cells within Scene::cells. It
/// goes on periodically.
struct CellGrid {
    std::uint32_t first = 0;
    int u_bits = 0;
    int v_bits = 0;

    std::uint32_t index(int u, int v) const {
        const int column = u & ((1 << u_bits) - 1);
        const int row = v & ((1 << v_bits) - 1);
        return first + static_cast<std::uint32_t>((row << u_bits) | column);
    }
};

/// A wall, or one flat of a post.
struct WallSurface {
    Segment segment;
    Eigen::Vector2d along;  ///< of length 1
    double length = 0.0;    ///< metres
    double u_start = 0.0;   ///< cells, at its start
    double u_cells = 1.0;   ///< along its length
    double v_cells = 1.0;   ///< upwards
    CellGrid cells;
    float shade = 1.0F;
};

/// How much of a part of a person's board the person fills.
enum class FigureCover { kNothing, kPart, kAll };

/// A person painted on an otherwise transparent board.
struct Figure {
    /// Between two corners, in texels of level 0 from the board's lower left one.
    FigureCover cover(const Eigen::Array2f& least, const Eigen::Array2f& most) const;

    static constexpr int kSquares = 16;  ///< to a cell's side
    CellGrid cells;
    int square_bits = 0;               ///< log2 of the texels to a square's side
    std::vector<FigureCover> squares;  ///< kSquares to a row, from the feet up
};

/// A world with its looks.
struct Scene {
    Scene(const World& world, const RenderConfig& config, int side_bits, std::uint64_t seed);

    TextureAtlas atlas;
    Lamps lamps;
    std::vector<std::uint16_t> cells;
    CellGrid floor;
    std::vector<float> floor_shine;  ///< of each of the floor's cells
    CellGrid roof;
    CellGrid haze;
    std::vector<Figure> figures;
    std::vector<WallSurface> walls;
};

}  // namespace hybrid_slam
