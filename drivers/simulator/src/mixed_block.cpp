// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "blocks.hpp"

namespace hybrid_slam {
namespace {

/// In front of the walls: the person whose board the ray meets, if only where it is transparent.
int person_at(const Skyline& skyline, std::size_t index, float slope, float camera_height) {
    const float nearness = skyline.people().nearness[index];
    const bool before = nearness > skyline.walls().nearness[index];
    const float top = static_cast<float>(kPersonHeight) - camera_height;
    const bool within = slope > -camera_height * nearness && slope < top * nearness;
    return before && within ? skyline.people().slot[index] : Skyline::kNone;
}

}  // namespace

void MixedPainter::paint(const View& view, const Rays& rays, int block, BlockLight& light) {
    block_ = block;
    met_ = 0;
    camera_height_ = static_cast<float>(view.middle().position.z());
    light.sums.setZero();
    light.gains.setZero();
    BlockTexels sums = BlockTexels::Zero();
    for (std::size_t i = 0; i < rays.samples.size(); ++i) {
        sort_rays(view, rays.samples[i], rays.spacing);
        add_sample(view, rays.samples[i], light, sums);
        if (i % 4 == 3) {
            add_group(sums, rays.group_bits, light.sums);
            sums.setZero();
        }
    }
    const auto& vignette = looks_.lens.blocks[static_cast<std::size_t>(block)].vignette;
    light.gains *= 0.25F / static_cast<float>(rays.samples.size()) * looks_.ramps.blend(vignette);
}

/// Finds what each ray of one sample meets; the comparisons are those of only_slot().
void MixedPainter::sort_rays(const View& view, const RaySample& sample, float spacing) {
    const Skyline& skyline = view.skyline(sample.moment);
    const LensBlock& lens = looks_.lens.blocks[static_cast<std::size_t>(block_)];
    const std::size_t first = LensMap::first_pixel(block_);
    const float entry_step =
        sample.du * lens.entry_du + sample.dv * lens.entry_dv - static_cast<float>(skyline.first());
    const float slope_step = sample.du * lens.slope_du + sample.dv * lens.slope_dv;
    const float* entries = &looks_.lens.entry[first];
    const float* slopes = &looks_.lens.slope[first];
    Numbers indices;
    const int last = skyline.size() - 1;
    for (std::size_t pixel = 0; pixel < kBlockPixels; ++pixel) {
        const auto entry = static_cast<std::int32_t>(entries[pixel] + entry_step);
        indices[pixel] = std::min(std::max(entry, 0), last);
    }
    const float above = looks_.wall_height - camera_height_;
    const float* nearness = skyline.walls().nearness.data();
    const int* slots = skyline.walls().slot.data();
    int last_slot = Skyline::kNone;
    int last_surface = Skyline::kNone;
    for (std::size_t pixel = 0; pixel < kBlockPixels; ++pixel) {
        const int index = indices[pixel];
        const float slope = slopes[pixel] + slope_step;
        int slot = slots[index];
        slot = slope > above * nearness[index] ? View::kRoofSlot : slot;
        slot = slope < -camera_height_ * nearness[index] ? View::kFloorSlot : slot;
        if (slot != last_slot) {
            last_slot = slot;
            last_surface = surface(view, slot, pixel, spacing);
        }
        behind_[pixel] = last_surface;
    }
    has_people_ = skyline.has_people();
    for (std::size_t pixel = 0; has_people_ && pixel < kBlockPixels; ++pixel) {
        const int person = person_at(skyline, static_cast<std::size_t>(indices[pixel]),
                                     slopes[pixel] + slope_step, camera_height_);
        person_[pixel] = person == Skyline::kNone ? person : surface(view, person, pixel, spacing);
    }
}

/// The number within surfaces_; of a new one for this block everything is set up.
int MixedPainter::surface(const View& view, int slot_number, std::size_t pixel, float spacing) {
    for (std::size_t i = 0; i < met_; ++i) {
        if (surfaces_[i].slot == slot_number) {
            return static_cast<int>(i);
        }
    }
    if (met_ == surfaces_.size()) {
        surfaces_.emplace_back();
    }
    Surface& made = surfaces_[met_];
    const Slot& slot = view.slots()[static_cast<std::size_t>(slot_number)];
    const PlaneMap& map = view.map(slot_number);
    const float* ray_x = &looks_.lens.ray_x[LensMap::first_pixel(block_)];
    const float* ray_y = &looks_.lens.ray_y[LensMap::first_pixel(block_)];
    made.slot = slot_number;
    made.ray = {ray_x[pixel], ray_y[pixel], 1.0F};
    made.spot = map.meet(made.ray);
    const Eigen::Vector3f right(looks_.pixel_x, 0.0F, 0.0F);
    const Eigen::Vector3f below(0.0F, looks_.pixel_y, 0.0F);
    made.grade = looks_.grade(slot_number, map.meet(made.ray + right) - made.spot,
                              map.meet(made.ray + below) - made.spot, spacing);
    made.source = looks_.source(slot, made.grade.level);
    made.scale = 1.0F / static_cast<float>(1 << made.grade.level);
    Eigen::Matrix3f scaled = map.rows;
    scaled.topRows<2>() *= made.scale;
    locate(scaled, ray_x, ray_y, made.spots);
    // Beside its edge a wall would go on with its other end.
    const bool standing = slot.kind == Slot::Kind::kWall || slot.kind == Slot::Kind::kPerson;
    const float rim = standing ? 0.5F * made.scale : 0.0F;
    made.least = {slot.u_least * made.scale + rim, rim};
    made.most = {slot.u_most * made.scale - rim, slot.v_most * made.scale - rim};
    set_light(view, made);
    return static_cast<int>(met_++);
}

void MixedPainter::look_up(const View& view, const RaySample& sample, Surface& surface) const {
    const Eigen::Vector3f ray = surface.ray + looks_.offset(sample, surface.grade);
    const Eigen::Vector2f step =
        surface.scale * (view.map(sample.moment, surface.slot).meet(ray) - surface.spot);
    BlockSpots spots;
    spots.u = (surface.spots.u + step.x()).max(surface.least.x()).min(surface.most.x());
    spots.v = (surface.spots.v + step.y()).max(surface.least.y()).min(surface.most.y());
    find_places(surface.source, spots, Eigen::Vector2f::Zero(), surface.places);
}

/// Between the block's corners, as in paint_surface(); but where the surface ends before a corner,
/// its plane may go on there to very far away.
void MixedPainter::set_light(const View& view, Surface& surface) const {
    const Slot& slot = view.slots()[static_cast<std::size_t>(surface.slot)];
    const float farthest = 8.0F * static_cast<float>(looks_.scene.atlas.side());
    std::array<float, 4> lights{};
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const int pixel = kCornerPixels[i];
        const Eigen::Vector2f spot(surface.spots.u[pixel], surface.spots.v[pixel]);
        const Eigen::Vector2f corner = spot / surface.scale;
        const bool near = (corner - surface.spot).cwiseAbs().maxCoeff() < farthest;
        lights[i] = looks_.light_at(view, slot, near ? corner : surface.spot);
    }
    surface.light = looks_.ramps.blend(lights);
}

void MixedPainter::add_sample(const View& view, const RaySample& sample, BlockLight& light,
                              BlockTexels& sums) {
    for (std::size_t i = 0; i < met_; ++i) {
        look_up(view, sample, surfaces_[i]);
    }
    for (int pixel = 0; pixel < kBlockPixels; ++pixel) {
        const auto at = static_cast<std::size_t>(pixel);
        const Surface* shown = &surfaces_[static_cast<std::size_t>(behind_[at])];
        Texel texel = shown->places.texel(shown->source, pixel);
        if (has_people_ && person_[at] != Skyline::kNone) {
            const Surface& person = surfaces_[static_cast<std::size_t>(person_[at])];
            const Texel before = person.places.texel(person.source, pixel);
            shown = before == kTransparent ? shown : &person;
            texel = before == kTransparent ? texel : before;
        }
        sums[pixel] += texel;
        light.gains[pixel] += shown->light[pixel];
    }
}

}  // namespace hybrid_slam
