// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "lens_map.hpp"
#include "texture_atlas.hpp"

namespace hybrid_slam {

/// Something for each pixel of a block.
using BlockFloats = Eigen::Array<float, kBlockPixels, 1>;
using BlockTexels = Eigen::Array<Texel, kBlockPixels, 1>;

/// Where the pixels of one block meet a surface, in texels of the level to be looked up.
struct BlockSpots {
    BlockFloats u;
    BlockFloats v;
};

/// The homography for all rays of a block; its first two rows in texels of the level.
void locate(const Eigen::Matrix3f& rows, const float* ray_x, const float* ray_y, BlockSpots& spots);

/// A surface at one level of its texture.
struct TexelSource {
    const Texel* texels = nullptr;
    const std::uint16_t* cells = nullptr;  ///< of this surface
    int side_bits = 0;                     ///< of a cell at this level
    int u_bits = 0;                        ///< of the grid of cells
    int v_bits = 0;
};

using FourSteps = std::array<Eigen::Vector2f, 4>;

/// For each spot the texels at four places beside it, summed up. The second needs all of them to
/// lie in the one cell at (u_cell, v_cell).
void sum_texels(const TexelSource& source, const BlockSpots& spots, const FourSteps& steps,
                BlockTexels& sums);
void sum_texels_of_cell(const TexelSource& source, const Eigen::Array2i& cell,
                        const BlockSpots& spots, const FourSteps& steps, BlockTexels& sums);

/// Where in `source` the texel of each spot is found: its cell, and its place within.
struct BlockPlaces {
    Eigen::Array<std::int32_t, kBlockPixels, 1> cell;
    Eigen::Array<std::int32_t, kBlockPixels, 1> within;

    Texel texel(const TexelSource& source, int pixel) const {
        const std::size_t picture = source.cells[cell[pixel]];
        return source
            .texels[(picture << (2 * source.side_bits)) | static_cast<std::size_t>(within[pixel])];
    }
};
void find_places(const TexelSource& source, const BlockSpots& spots, const Eigen::Vector2f& step,
                 BlockPlaces& places);

}  // namespace hybrid_slam
