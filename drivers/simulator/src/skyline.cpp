// SPDX-License-Identifier: Apache-2.0
#include "skyline.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hybrid_slam {

Skyline::Skyline(const HorizonFaces& faces, int first, int last) : faces_(faces), first_(first) {
    const auto entries = static_cast<std::size_t>(last - first) + 1;
    for (Layer* layer : {&walls_, &people_}) {
        layer->nearness.resize(entries);
        layer->slot.resize(entries);
    }
    run_end_.resize(entries);
    next_person_.resize(entries);
}

void Skyline::clear() {
    has_people_ = false;
    for (Layer* layer : {&walls_, &people_}) {
        std::fill(layer->nearness.begin(), layer->nearness.end(), 0.0F);
        std::fill(layer->slot.begin(), layer->slot.end(), kNone);
    }
}

void Skyline::add(Layer& layer, const Eigen::Vector2d& start, const Eigen::Vector2d& end,
                  int slot) {
    for (int face = 0; face < HorizonFaces::kFaces; ++face) {
        const bool seen =
            (face + 1) * faces_.entries > first_ && face * faces_.entries < first_ + size();
        if (seen) {
            add_in_face(layer, HorizonFaces::in_face(face, start), HorizonFaces::in_face(face, end),
                        face, slot);
        }
    }
}

void Skyline::add_in_face(Layer& layer, Eigen::Vector2d start, Eigen::Vector2d end, int face,
                          int slot) {
    constexpr double kNearest = 0.02;  // metres
    if (start.x() < end.x()) {
        std::swap(start, end);
    }
    if (!(start.x() > kNearest)) {
        return;
    }
    if (end.x() < kNearest) {
        end = start + (start.x() - kNearest) / (start.x() - end.x()) * (end - start);
    }
    double entry = faces_.entry(face, start.y() / start.x()) - first_;
    double last_entry = faces_.entry(face, end.y() / end.x()) - first_;
    double nearness = 1.0 / start.x();
    double last_nearness = 1.0 / end.x();
    if (entry > last_entry) {
        std::swap(entry, last_entry);
        std::swap(nearness, last_nearness);
    }
    // Entries whose middle lies on the wall; walls that share a corner share none and miss none.
    const double low = std::max(0, face * faces_.entries - first_);
    const double high = std::min(size(), (face + 1) * faces_.entries - first_);
    const auto begin = static_cast<int>(std::clamp(std::ceil(entry - 0.5), low, high));
    const auto stop = static_cast<int>(std::clamp(std::ceil(last_entry - 0.5), low, high));
    if (begin >= stop) {
        return;
    }
    const double step = (last_nearness - nearness) / (last_entry - entry);
    const auto at_begin = static_cast<float>(nearness + step * (begin + 0.5 - entry));
    const auto float_step = static_cast<float>(step);
    float* nearest = &layer.nearness[static_cast<std::size_t>(begin)];
    int* slots = &layer.slot[static_cast<std::size_t>(begin)];
    for (int i = 0; i < stop - begin; ++i) {
        const float here = at_begin + float_step * static_cast<float>(i);
        const bool nearer = here > nearest[i];
        nearest[i] = nearer ? here : nearest[i];
        slots[i] = nearer ? slot : slots[i];
    }
}

void Skyline::finish() {
    int run_end = size() - 1;
    int next_person = size();
    for (int i = size() - 1; i >= 0; --i) {
        const auto at = static_cast<std::size_t>(i);
        if (at + 1 < walls_.slot.size() && walls_.slot[at] != walls_.slot[at + 1]) {
            run_end = i;
        }
        run_end_[at] = run_end;
        if (people_.slot[at] != kNone) {
            next_person = i;
        }
        next_person_[at] = next_person;
    }
}

}  // namespace hybrid_slam
