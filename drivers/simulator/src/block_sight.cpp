// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "blocks.hpp"

namespace hybrid_slam {
namespace {

/// One block as seen at one moment.
class BlockSight {
  public:
    BlockSight(const Looks& looks, const View& view, std::size_t moment, int block)
        : looks_(looks),
          view_(view),
          moment_(moment),
          block_(block),
          lens_(looks.lens.blocks[static_cast<std::size_t>(block)]),
          skyline_(view.skyline(moment)),
          low_(static_cast<std::size_t>(lens_.least_entry - skyline_.first())),
          high_(static_cast<std::size_t>(lens_.most_entry - skyline_.first())),
          camera_height_(static_cast<float>(view.middle().position.z())) {}

    int only_slot() const;

  private:
    bool may_show_person() const;
    FigureCover cover_by(int slot) const;
    int slot_behind_people() const;

    const Looks& looks_;
    const View& view_;
    std::size_t moment_;
    int block_;
    const LensBlock& lens_;
    const Skyline& skyline_;
    std::size_t low_;
    std::size_t high_;
    float camera_height_;
};

int BlockSight::only_slot() const {
    if (!skyline_.has_people() || !may_show_person()) {
        return slot_behind_people();
    }
    const int person =
        skyline_.people().slot[static_cast<std::size_t>(skyline_.next_person()[low_])];
    bool alone = true;
    bool before = true;
    for (std::size_t i = low_; i <= high_; ++i) {
        const int here = skyline_.people().slot[i];
        alone = alone && (here == person || here == Skyline::kNone);
        before = before && here == person &&
                 skyline_.people().nearness[i] > skyline_.walls().nearness[i];
    }
    if (!alone) {
        return Skyline::kNone;
    }
    switch (cover_by(person)) {
        case FigureCover::kNothing:
            return slot_behind_people();
        case FigureCover::kAll:
            return before ? person : Skyline::kNone;
        case FigureCover::kPart:
            break;
    }
    return Skyline::kNone;
}

/// Whether any ray may meet the board on which a person is painted, before a wall.
bool BlockSight::may_show_person() const {
    const float above = static_cast<float>(kPersonHeight) - camera_height_;
    for (auto i = static_cast<std::size_t>(skyline_.next_person()[low_]); i <= high_; ++i) {
        const float nearness = skyline_.people().nearness[i];
        if (nearness > skyline_.walls().nearness[i] &&
            lens_.most_slope > -camera_height_ * nearness && lens_.least_slope < above * nearness) {
            return true;
        }
    }
    return false;
}

/// By the texels that lie between those of the block's corners, and a margin of a pixel or two.
FigureCover BlockSight::cover_by(int slot_number) const {
    const PlaneMap& map = view_.map(moment_, slot_number);
    const float* ray_x = &looks_.lens.ray_x[LensMap::first_pixel(block_)];
    const float* ray_y = &looks_.lens.ray_y[LensMap::first_pixel(block_)];
    Eigen::Array2f least;
    Eigen::Array2f most;
    for (std::size_t i = 0; i < kCornerPixels.size(); ++i) {
        const int pixel = kCornerPixels[i];
        const Eigen::Array2f spot = map.meet({ray_x[pixel], ray_y[pixel], 1.0F});
        least = i == 0 ? spot : least.min(spot);
        most = i == 0 ? spot : most.max(spot);
    }
    const Eigen::Array2f margin = (most - least) / 4.0F + 2.0F;
    const std::size_t figure = view_.slots()[static_cast<std::size_t>(slot_number)].figure;
    return looks_.scene.figures[figure].cover(least - margin, most + margin);
}

/// With the camera at the height c, the rise s of a ray ends on the floor before a wall of the
/// nearness n when s < -c n, and passes over the wall of the height h when s > (h - c) n.
int BlockSight::slot_behind_people() const {
    const std::vector<float>& nearness = skyline_.walls().nearness;
    const bool single = skyline_.run_end()[low_] >= static_cast<int>(high_);
    const int entries = looks_.lens.faces.entries;
    const bool one_face = lens_.least_entry / entries == lens_.most_entry / entries;
    float least = std::min(nearness[low_], nearness[high_]);
    float most = std::max(nearness[low_], nearness[high_]);
    if (!single || !one_face) {
        for (std::size_t i = low_; i <= high_; ++i) {
            least = std::min(least, nearness[i]);
            most = std::max(most, nearness[i]);
        }
    }
    const float above = looks_.wall_height - camera_height_;
    if (lens_.most_slope < -camera_height_ * most) {
        return View::kFloorSlot;
    }
    if (lens_.least_slope > above * most) {
        return View::kRoofSlot;
    }
    const bool within =
        lens_.least_slope > -camera_height_ * least && lens_.most_slope < above * least;
    return single && within ? skyline_.walls().slot[low_] : Skyline::kNone;
}

}  // namespace

int only_slot(const Exposure& exposure, int block) {
    const auto slot_at = [&](std::size_t moment) {
        return BlockSight(exposure.looks, exposure.view, moment, block).only_slot();
    };
    const int slot = slot_at(0);
    for (std::size_t moment = 1; moment < exposure.rays.moments.size(); ++moment) {
        if (slot == Skyline::kNone || slot_at(moment) != slot) {
            return Skyline::kNone;
        }
    }
    return slot;
}

}  // namespace hybrid_slam
