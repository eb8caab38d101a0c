// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "looks.hpp"

namespace hybrid_slam {

/// The surface on which all rays of the block end at all moments; Skyline::kNone when that is not
/// sure.
int only_slot(const Exposure& exposure, int block);

/// Paints a block of which all rays end on one surface.
void paint_surface(const Exposure& exposure, int block, int slot, BlockLight& light);

/// Paints blocks where several surfaces meet: sorts out which ray ends where, then looks up each
/// surface for all of the block at once.
class MixedPainter {
  public:
    explicit MixedPainter(const Looks& looks) : looks_(looks) {}

    void paint(const View& view, const Rays& rays, int block, BlockLight& light);

  private:
    /// A surface that a ray of the block has met.
    struct Surface {
        int slot = Skyline::kNone;
        Grade grade;
        TexelSource source;
        float scale = 1.0F;    ///< from texels of level 0 to those of the level
        Eigen::Vector3f ray;   ///< the first that met it
        Eigen::Vector2f spot;  ///< of that ray; texels of level 0
        BlockSpots spots;      ///< texels of the level, as are the limits
        Eigen::Array2f least;
        Eigen::Array2f most;
        BlockPlaces places;  ///< of one sample
        BlockFloats light;
    };
    using Numbers = std::array<int, kBlockPixels>;

    void sort_rays(const View& view, const RaySample& sample, float spacing);
    int surface(const View& view, int slot, std::size_t pixel, float spacing);
    void look_up(const View& view, const RaySample& sample, Surface& surface) const;
    void set_light(const View& view, Surface& surface) const;
    void add_sample(const View& view, const RaySample& sample, BlockLight& light,
                    BlockTexels& sums);

    const Looks& looks_;
    int block_ = 0;
    float camera_height_ = 0.0F;
    std::vector<Surface> surfaces_;  ///< the first met_ are of this block
    std::size_t met_ = 0;
    bool has_people_ = false;
    Numbers person_{};  ///< of surfaces_, before the walls; or kNone
    Numbers behind_{};  ///< of surfaces_
};

}  // namespace hybrid_slam
