// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "painter.hpp"

namespace hybrid_slam {
namespace {

constexpr Color kNothing{-1.0F, 0.0F, 0.0F};  ///< see TextureAtlas::add()

struct Outfit {
    Color top;
    Color trousers;
    bool vest = false;  ///< with reflecting stripes
};

bool in_ellipse(float x, float y, float x0, float y0, const Eigen::Vector2f& radii) {
    const float dx = (x - x0) / radii.x();
    const float dy = (y - y0) / radii.y();
    return dx * dx + dy * dy < 1.0F;
}

float ramp(float from, float to, float share) {
    return from + (to - from) * std::clamp(share, 0.0F, 1.0F);
}

/// A round limb: darker towards its sides, nothing beyond them.
Color limb(const Color& color, float beside, float half_width) {
    const float share = beside / half_width;
    return std::abs(share) < 1.0F ? color * (1.05F - 0.4F * share * share) : kNothing;
}

Color torso(const Outfit& outfit, float side, float height) {
    // Shoulders slope down from the neck; the waist is narrower.
    const float shoulder = height > 0.8F ? ramp(0.1F, 0.045F, (height - 0.8F) / 0.045F) : 0.1F;
    const float half = std::min(shoulder, ramp(0.082F, 0.1F, (height - 0.58F) / 0.2F));
    const bool stripe = std::abs(height - 0.6F) < 0.014F || std::abs(height - 0.7F) < 0.014F;
    return limb(outfit.vest && stripe ? Color{215.0F, 220.0F, 220.0F} : outfit.top, side, half);
}

/// What shows at `height` and `side` of the middle line, both as shares of the person's height.
Color figure(const Outfit& outfit, float side, float height) {
    const Color skin{120.0F, 145.0F, 195.0F};
    const float out = std::abs(side);
    if (in_ellipse(side, height, 0.0F, 0.93F, {0.045F, 0.068F})) {
        return limb(height > 0.955F ? Color{28.0F, 34.0F, 42.0F} : skin, side, 0.05F);
    }
    if (height > 0.83F) {
        return height < 0.88F ? limb(skin * 0.9F, side, 0.026F) : kNothing;
    }
    const float arm = ramp(0.14F, 0.108F, (height - 0.45F) / 0.35F);
    const float arm_half = ramp(0.017F, 0.027F, (height - 0.42F) / 0.35F);
    if (height > 0.42F && height < 0.82F && std::abs(out - arm) < arm_half) {
        return limb(height < 0.47F ? skin : outfit.top * 0.88F, out - arm, arm_half);
    }
    if (height > 0.49F) {
        return torso(outfit, side, height);
    }
    const float leg = ramp(0.062F, 0.045F, height / 0.49F);
    const float leg_half = ramp(0.03F, 0.046F, height / 0.49F);
    return limb(height < 0.04F ? Color{25.0F, 25.0F, 28.0F} : outfit.trousers, out - leg, leg_half);
}

}  // namespace

std::vector<Pictures> paint_people(Painter& painter) {
    constexpr float kAspect = 0.33F;  // of the widest place to the height
    const std::vector<Outfit> outfits = {{{40.0F, 170.0F, 225.0F}, {70.0F, 52.0F, 44.0F}, true},
                                         {{120.0F, 84.0F, 58.0F}, {58.0F, 56.0F, 56.0F}, false},
                                         {{60.0F, 62.0F, 120.0F}, {92.0F, 86.0F, 80.0F}, false}};
    std::vector<Pictures> people;
    for (const Outfit& outfit : outfits) {
        Pictures rows;
        for (int row = 0; row < kPersonRows; ++row) {
            Canvas canvas(painter.atlas.side());
            const int shift = painter.below(canvas.side());
            canvas.paint([&](float x, float y, Color& color) {
                const float height = (static_cast<float>(row) + y) / kPersonRows;
                color = figure(outfit, (x - 0.5F) * kAspect, height);
                const auto column = static_cast<int>(x * static_cast<float>(canvas.side()));
                const auto line = static_cast<int>(y * static_cast<float>(canvas.side()));
                const float fold = painter.clouds.at(column, line + shift);
                color = color.b < 0.0F ? color : color * (1.0F + 0.08F * fold);
            });
            rows.push_back(painter.atlas.add(canvas));
        }
        people.push_back(rows);
    }
    return people;
}

}  // namespace hybrid_slam
