// SPDX-License-Identifier: Apache-2.0
#include "looks.hpp"

#include <algorithm>

namespace hybrid_slam {

BlockRamps::BlockRamps() {
    constexpr float kStep = 1.0F / (kBlock - 1);
    for (int pixel = 0; pixel < kBlockPixels; ++pixel) {
        const int row = pixel / kBlock;
        across[pixel] = kStep * static_cast<float>(pixel % kBlock);
        down[pixel] = kStep * static_cast<float>(row);
    }
    both = across * down;
}

Looks::Looks(const Scene& scene_in, const LensMap& lens_in, const CameraModel& model,
             const RenderConfig& config)
    : scene(scene_in),
      lens(lens_in),
      pixel_x(static_cast<float>(1.0 / model.fx)),
      pixel_y(static_cast<float>(1.0 / model.fy)),
      brightness(static_cast<float>(config.brightness)),
      wall_height(static_cast<float>(config.wall_height)),
      ceiling_height(static_cast<float>(config.ceiling_height)) {}

Grade Looks::grade(int slot, const Eigen::Vector2f& per_column, const Eigen::Vector2f& per_row,
                   float spacing) const {
    constexpr float kFewest = 0.25F;  // texels between samples
    constexpr float kWidest = 8.0F;
    const float across = per_column.norm();
    const float down = per_row.norm();
    // The four samples take care of a footprint that is longer than it is wide.
    const float wanted = std::max(spacing * std::max(across, down), 0.7F * std::min(across, down));
    Grade made;
    made.slot = slot;
    while (made.level < scene.atlas.side_bits() && static_cast<float>(1 << made.level) < wanted) {
        ++made.level;
    }
    made.spread_u = std::clamp(kFewest / std::max(spacing * across, 1e-3F), 1.0F, kWidest);
    made.spread_v = std::clamp(kFewest / std::max(spacing * down, 1e-3F), 1.0F, kWidest);
    return made;
}

float Looks::light_at(const View& view, const Slot& slot, const Eigen::Vector2f& spot) const {
    if (slot.kind == Slot::Kind::kRoof) {
        return brightness;
    }
    const Eigen::Vector2f place = slot.origin + spot.x() * slot.u_step + spot.y() * slot.v_step;
    const float light = brightness * scene.lamps.light(place.x(), place.y());
    if (slot.kind == Slot::Kind::kPerson) {
        return light;
    }
    if (slot.kind == Slot::Kind::kWall) {
        return light * slot.shade * (0.92F + 0.04F * slot.rise * spot.y());
    }
    const int bits = scene.atlas.side_bits();
    const std::uint32_t cell =
        slot.cells.index(static_cast<int>(spot.x()) >> bits, static_cast<int>(spot.y()) >> bits);
    const float shine = scene.floor_shine[cell - slot.cells.first];
    // The mirrored ray goes on to the ceiling, farther in the ratio of the heights.
    const Eigen::Vector2f camera = view.middle().position.head<2>().cast<float>();
    const auto height = static_cast<float>(view.middle().position.z());
    const Eigen::Vector2f mirrored =
        camera + (place - camera) * ((height + ceiling_height) / height);
    return light * (1.0F + shine * scene.lamps.glint(mirrored.x(), mirrored.y()));
}

TexelSource Looks::source(const Slot& slot, int level) const {
    TexelSource source;
    source.texels = scene.atlas.level(level);
    source.cells = &scene.cells[slot.cells.first];
    source.side_bits = scene.atlas.side_bits() - level;
    source.u_bits = slot.cells.u_bits;
    source.v_bits = slot.cells.v_bits;
    return source;
}

void add_group(const BlockTexels& sums, unsigned group_bits, BlockTexels& total) {
    const Texel field = kFieldMask >> group_bits;
    const Texel fields = field | field << kFieldBits | field << (2 * kFieldBits);
    for (int i = 0; i < kBlockPixels; ++i) {
        total[i] += (sums[i] >> group_bits) & fields;
    }
}

}  // namespace hybrid_slam
