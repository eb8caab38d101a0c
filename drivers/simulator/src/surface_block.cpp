// SPDX-License-Identifier: Apache-2.0
#include "blocks.hpp"
#include "texel_sums.hpp"

namespace hybrid_slam {
namespace {

using Corners = std::array<Eigen::Vector2f, 4>;

/// A surface as it is looked up for one block.
struct Patch {
    Eigen::Vector3f center;       ///< the middle ray
    Eigen::Vector2f center_spot;  ///< texels of level 0, as are the corners
    Corners corners;
    Grade grade;
    TexelSource source;
};

Patch patch_of(const Looks& looks, const View& view, int block, int slot_number, float spacing) {
    const Slot& slot = view.slots()[static_cast<std::size_t>(slot_number)];
    const PlaneMap& map = view.map(slot_number);
    const float* ray_x = &looks.lens.ray_x[LensMap::first_pixel(block)];
    const float* ray_y = &looks.lens.ray_y[LensMap::first_pixel(block)];
    Patch patch;
    patch.center = {0.5F * (ray_x[0] + ray_x[kBlockPixels - 1]),
                    0.5F * (ray_y[0] + ray_y[kBlockPixels - 1]), 1.0F};
    patch.center_spot = map.meet(patch.center);
    for (std::size_t i = 0; i < kCornerPixels.size(); ++i) {
        const int pixel = kCornerPixels[i];
        patch.corners[i] = map.meet({ray_x[pixel], ray_y[pixel], 1.0F});
    }
    const auto& [top_left, top_right, bottom_left, bottom_right] = patch.corners;
    constexpr float kStep = 0.5F / (kBlock - 1);
    patch.grade =
        looks.grade(slot_number, kStep * (top_right - top_left + bottom_right - bottom_left),
                    kStep * (bottom_left - top_left + bottom_right - top_right), spacing);
    patch.source = looks.source(slot, patch.grade.level);
    return patch;
}

void sum_patch(const Patch& patch, const BlockSpots& spots, const FourSteps& steps,
               BlockTexels& sums) {
    Eigen::Array2f farthest = Eigen::Array2f::Zero();
    for (const Eigen::Vector2f& step : steps) {
        farthest = farthest.max(step.array().abs());
    }
    farthest = (farthest + 1.0F) * static_cast<float>(1 << patch.grade.level);
    Eigen::Array2f least = patch.corners[0];
    Eigen::Array2f most = patch.corners[0];
    for (const Eigen::Vector2f& corner : patch.corners) {
        least = least.min(corner.array());
        most = most.max(corner.array());
    }
    const float cells =
        1.0F / static_cast<float>(1 << (patch.source.side_bits + patch.grade.level));
    // Cut off towards zero like the texels; cell 0 then reaches to both sides of it.
    const Eigen::Array2i low = (cells * (least - farthest)).cast<int>();
    const Eigen::Array2i high = (cells * (most + farthest)).cast<int>();
    if ((low == high).all()) {
        sum_texels_of_cell(patch.source, low, spots, steps, sums);
    } else {
        sum_texels(patch.source, spots, steps, sums);
    }
}

BlockFloats gains_of(const Looks& looks, const View& view, int block, const Slot& slot,
                     const Corners& corners) {
    const LensBlock& lens = looks.lens.blocks[static_cast<std::size_t>(block)];
    std::array<float, 4> gains{};
    for (std::size_t i = 0; i < gains.size(); ++i) {
        gains[i] = 0.25F * lens.vignette[i] * looks.light_at(view, slot, corners[i]);
    }
    return looks.ramps.blend(gains);
}

}  // namespace

void paint_surface(const Exposure& exposure, int block, int slot, BlockLight& light) {
    const auto& [looks, view, rays] = exposure;
    const Patch patch = patch_of(looks, view, block, slot, rays.spacing);
    light.gains =
        gains_of(looks, view, block, view.slots()[static_cast<std::size_t>(slot)], patch.corners);
    const float scale = 1.0F / static_cast<float>(1 << patch.grade.level);
    Eigen::Matrix3f scaled = view.map(slot).rows;
    scaled.topRows<2>() *= scale;
    BlockSpots spots;
    locate(scaled, &looks.lens.ray_x[LensMap::first_pixel(block)],
           &looks.lens.ray_y[LensMap::first_pixel(block)], spots);

    light.sums.setZero();
    BlockTexels sums;
    for (std::size_t first = 0; first < rays.samples.size(); first += 4) {
        FourSteps steps;
        for (std::size_t k = 0; k < 4; ++k) {
            const RaySample& sample = rays.samples[first + k];
            // Taken at the middle ray: it hardly changes within a block.
            const Eigen::Vector3f ray = patch.center + looks.offset(sample, patch.grade);
            steps[k] = scale * (view.map(sample.moment, slot).meet(ray) - patch.center_spot);
        }
        sum_patch(patch, spots, steps, sums);
        add_group(sums, rays.group_bits, light.sums);
    }
}

}  // namespace hybrid_slam
