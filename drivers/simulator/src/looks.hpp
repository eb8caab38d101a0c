// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "hybrid_slam/simulator/render_config.hpp"
#include "lens_map.hpp"
#include "scene.hpp"
#include "texel_sums.hpp"
#include "view.hpp"

namespace hybrid_slam {

/// One of the rays that are averaged to a pixel: where in the pixel and when.
struct RaySample {
    float du = 0.0F;  ///< pixels from the middle
    float dv = 0.0F;
    std::size_t moment = 0;
};

/// The rays of all pixels of a frame.
struct Rays {
    std::vector<RaySample> samples;  ///< groups of four, each spread evenly over the pixel
    unsigned group_bits = 0;         ///< log2 of the number of groups
    std::vector<double> moments;     ///< seconds around the middle of the exposure
    float spacing = 0.25F;           ///< pixels between neighbours of the four
};

/// The light that falls onto the pixels of one block.
struct BlockLight {
    BlockTexels sums;   ///< of four texels
    BlockFloats gains;  ///< from there to gray levels
};

/// Blends from a block's corners to its pixels.
struct BlockRamps {
    BlockRamps();

    BlockFloats blend(const std::array<float, 4>& corners) const {
        return corners[0] + (corners[1] - corners[0]) * across + (corners[2] - corners[0]) * down +
               (corners[0] - corners[1] - corners[2] + corners[3]) * both;
    }

    BlockFloats across;  ///< 0 at the left, 1 at the right
    BlockFloats down;
    BlockFloats both;
};

/// How finely a surface is looked up.
struct Grade {
    int slot = Skyline::kNone;
    int level = 0;
    float spread_u = 1.0F;  ///< of the samples across, where texels are larger than pixels
    float spread_v = 1.0F;  ///< down
};

/// What paints blocks: the scene, the lens and how bright things are.
struct Looks {
    Looks(const Scene& scene_in, const LensMap& lens_in, const CameraModel& model,
          const RenderConfig& config);

    /// From the texels per column and per row of pixels.
    Grade grade(int slot, const Eigen::Vector2f& per_column, const Eigen::Vector2f& per_row,
                float spacing) const;

    /// Factor from a texel to gray levels, before the lens; `spot` in texels of level 0.
    float light_at(const View& view, const Slot& slot, const Eigen::Vector2f& spot) const;

    /// The slot's surface at a level.
    TexelSource source(const Slot& slot, int level) const;

    /// From the sample's middle to where it goes through the plane z = 1 of the camera.
    Eigen::Vector3f offset(const RaySample& sample, const Grade& grade) const {
        return {sample.du * grade.spread_u * pixel_x, sample.dv * grade.spread_v * pixel_y, 0.0F};
    }

    const Scene& scene;
    const LensMap& lens;
    float pixel_x;  ///< one pixel on the plane z = 1
    float pixel_y;
    float brightness;
    float wall_height;
    float ceiling_height;
    BlockRamps ramps;
};

/// What the blocks of one frame are painted from.
struct Exposure {
    const Looks& looks;
    const View& view;
    const Rays& rays;
};

/// Adds the sums of four texels, divided by the number of the groups of four.
void add_group(const BlockTexels& sums, unsigned group_bits, BlockTexels& total);

}  // namespace hybrid_slam
