// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hybrid_slam/simulator/render_config.hpp"
#include "texture_atlas.hpp"

namespace hybrid_slam {

using Picture = std::uint16_t;  ///< of the atlas
using Pictures = std::vector<Picture>;

/// Much more than is painted, so that the atlas need not move while it grows.
inline constexpr std::size_t kMostPictures = 128;
inline constexpr int kConcreteCells = 4;  ///< the bare floor repeats after so many cells each way
inline constexpr int kDoorRows = 4;
inline constexpr int kPersonRows = 3;

struct FloorMaterials {
    Pictures tiles;     ///< speckled, dirty, with joints: rich in features
    Pictures concrete;  ///< kConcreteCells squared, row by row: next to no features
    Pictures gloss;     ///< painted and smooth: none
    Pictures lines_x;   ///< a yellow line along x
    Pictures lines_y;
    Pictures marks;  ///< drains, stains, tape
};

struct WallMaterials {
    Pictures brick;
    Pictures block;     ///< hollow blocks of concrete
    Pictures panel;     ///< sheet metal with vertical ribs
    Pictures plain;     ///< white paint: next to no features
    Pictures skirting;  ///< plain, with a skirting board
    Pictures door;      ///< two columns of kDoorRows, bottom up
    Pictures signs;     ///< on white paint
    Pictures posters;   ///< on brick
    Pictures cartons;
    Pictures pallets;  ///< cartons on a pallet
    Pictures beams;    ///< cartons above the beam of a rack
};

struct Materials {
    FloorMaterials floor;
    WallMaterials walls;
    Pictures roof;  ///< dark, beam along x, lamp
    Picture haze = 0;
    std::vector<Pictures> people;  ///< kPersonRows each, bottom up
};

/// Paints everything; the same seed gives the same pictures.
Materials paint_materials(TextureAtlas& atlas, const RenderConfig& config, std::uint64_t seed);

}  // namespace hybrid_slam
