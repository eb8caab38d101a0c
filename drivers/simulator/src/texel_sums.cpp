// SPDX-License-Identifier: Apache-2.0
#include "texel_sums.hpp"

namespace hybrid_slam {
namespace {

using Numbers = Eigen::Array<std::int32_t, kBlockPixels, 1>;

/// Whole numbers by cutting off: texels count from zero up but for a rim that nobody sees.
void find_within(const TexelSource& source, const BlockSpots& spots, const Eigen::Vector2f& step,
                 Numbers& within) {
    const int bits = source.side_bits;
    const int mask = (1 << bits) - 1;
    const float du = step.x();
    const float dv = step.y();
    for (int i = 0; i < kBlockPixels; ++i) {
        const auto u = static_cast<std::int32_t>(spots.u[i] + du);
        const auto v = static_cast<std::int32_t>(spots.v[i] + dv);
        within[i] = ((v & mask) << bits) | (u & mask);
    }
}

}  // namespace

void locate(const Eigen::Matrix3f& rows, const float* ray_x, const float* ray_y,
            BlockSpots& spots) {
    const Eigen::Map<const BlockFloats> x(ray_x);
    const Eigen::Map<const BlockFloats> y(ray_y);
    const BlockFloats w =
        1.0F / (rows(2, 0) * x + rows(2, 1) * y + rows(2, 2)).max(kLeastDepthShare);
    spots.u = (rows(0, 0) * x + rows(0, 1) * y + rows(0, 2)) * w;
    spots.v = (rows(1, 0) * x + rows(1, 1) * y + rows(1, 2)) * w;
}

void find_places(const TexelSource& source, const BlockSpots& spots, const Eigen::Vector2f& step,
                 BlockPlaces& places) {
    const int bits = source.side_bits;
    const int mask = (1 << bits) - 1;
    const int u_bits = source.u_bits;
    const int u_mask = (1 << u_bits) - 1;
    const int v_mask = (1 << source.v_bits) - 1;
    const float du = step.x();
    const float dv = step.y();
    for (int i = 0; i < kBlockPixels; ++i) {
        const auto u = static_cast<std::int32_t>(spots.u[i] + du);
        const auto v = static_cast<std::int32_t>(spots.v[i] + dv);
        places.cell[i] = (((v >> bits) & v_mask) << u_bits) | ((u >> bits) & u_mask);
        places.within[i] = ((v & mask) << bits) | (u & mask);
    }
}

void sum_texels(const TexelSource& source, const BlockSpots& spots, const FourSteps& steps,
                BlockTexels& sums) {
    std::array<BlockPlaces, 4> places;
    for (std::size_t k = 0; k < 4; ++k) {
        find_places(source, spots, steps[k], places[k]);
    }
    for (int i = 0; i < kBlockPixels; ++i) {
        sums[i] = places[0].texel(source, i) + places[1].texel(source, i) +
                  places[2].texel(source, i) + places[3].texel(source, i);
    }
}

void sum_texels_of_cell(const TexelSource& source, const Eigen::Array2i& cell,
                        const BlockSpots& spots, const FourSteps& steps, BlockTexels& sums) {
    std::array<Numbers, 4> within;
    for (std::size_t k = 0; k < 4; ++k) {
        find_within(source, spots, steps[k], within[k]);
    }
    const int column = cell.x() & ((1 << source.u_bits) - 1);
    const int row = cell.y() & ((1 << source.v_bits) - 1);
    const std::size_t picture = source.cells[(row << source.u_bits) | column];
    const Texel* texels = source.texels + (picture << (2 * source.side_bits));
    for (int i = 0; i < kBlockPixels; ++i) {
        sums[i] = texels[within[0][i]] + texels[within[1][i]] + texels[within[2][i]] +
                  texels[within[3][i]];
    }
}

}  // namespace hybrid_slam
