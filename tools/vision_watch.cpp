// SPDX-License-Identifier: Apache-2.0
#include "vision_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace hybrid_slam::tools {
namespace {

/// Without a motion, or with one half of it: a spell is of one of the two.
enum class Kind { kGood, kDoubtful, kBad };

Kind kind_of(VisualStatus status) {
    return status == VisualStatus::kGood           ? Kind::kGood
           : status == VisualStatus::kGroundHidden ? Kind::kDoubtful
                                                   : Kind::kBad;
}

}  // namespace

std::string words_for(VisualStatus status) {
    switch (status) {
        case VisualStatus::kFirst:
            return "first of a row";
        case VisualStatus::kGood:
            return "good";
        case VisualStatus::kTooDark:
            return "too dark";
        case VisualStatus::kBlurred:
            return "blurred";
        case VisualStatus::kTooFewFeatures:
            return "too few features";
        case VisualStatus::kGroundHidden:
            return "ground hidden";
        case VisualStatus::kInconsistent:
            return "inconsistent";
    }
    return "unknown";
}

std::size_t Vision::with(VisualStatus status) const {
    const auto found = statuses.find(status);
    return found == statuses.end() ? 0 : found->second;
}

std::size_t Vision::usable() const {
    return with(VisualStatus::kGood) + with(VisualStatus::kGroundHidden);
}

std::vector<std::string> Vision::warnings() const {
    std::map<VisualStatus, std::pair<double, int>> sums;
    for (const BadSpell& spell : spells) {
        sums[spell.status].first += spell.duration();
        ++sums[spell.status].second;
    }
    std::vector<std::string> warnings;
    for (const auto& [status, sum] : sums) {
        const auto& [seconds, times] = sum;
        warnings.push_back(fmt::format(
            "camera{} {} for {:.1f} s{}", status == VisualStatus::kTooFewFeatures ? " with" : "",
            words_for(status), seconds, times > 1 ? fmt::format(" in {} spells", times) : ""));
    }
    return warnings;
}

void VisionWatch::see(const VisualMotion& motion) {
    ++vision_.images;
    ++vision_.statuses[motion.status];
    const bool first = motion.status == VisualStatus::kFirst;
    // What starts anew in the middle of a spell, when the camera came back, belongs to it.
    if (spell_ && !first && kind_of(motion.status) != kind_of(spell_->status)) {
        end_spell();
    }
    if (!first && kind_of(motion.status) != Kind::kGood) {
        if (!spell_) {
            spell_ = BadSpell{motion.status, newest_.value_or(motion.stamp), motion.stamp};
        }
        ++spell_statuses_[motion.status];
    }
    if (spell_) {
        spell_->to = motion.stamp;
    }
    newest_ = motion.stamp;
}

void VisionWatch::see_scan(const std::optional<double>& lag) {
    if (!lag) {
        return;  // before the first image
    }
    vision_.extrapolated += *lag > 0.0 ? 1 : 0;
    vision_.late += *lag > Vision::kLateImage ? 1 : 0;
}

void VisionWatch::end_spell() {
    using Count = std::pair<const VisualStatus, std::size_t>;
    spell_->status =
        std::max_element(spell_statuses_.begin(), spell_statuses_.end(),
                         [](const Count& a, const Count& b) { return a.second < b.second; })
            ->first;
    if (spell_->duration() >= Vision::kLeastSpell) {
        vision_.spells.push_back(*spell_);
    }
    spell_.reset();
    spell_statuses_.clear();
}

Vision VisionWatch::finish() {
    if (spell_) {
        end_spell();
    }
    return std::move(vision_);
}

}  // namespace hybrid_slam::tools
