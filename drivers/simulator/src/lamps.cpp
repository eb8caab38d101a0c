// SPDX-License-Identifier: Apache-2.0
#include "lamps.hpp"

#include <cmath>

#include "canvas.hpp"
#include "hash.hpp"

namespace hybrid_slam {
namespace {

constexpr float kSpan = static_cast<float>(Lamps::kEachWay * Lamps::kSpacing);

/// Cosine law at both ends: intensity over squared distance.
double irradiance(double dx, double dy, double height) {
    const double squared = height * height / (dx * dx + dy * dy + height * height);
    return squared * squared;
}

/// std::floor without a call.
int floor_of(float value) {
    const auto whole = static_cast<int>(value);
    return whole - static_cast<int>(static_cast<float>(whole) > value);
}

}  // namespace

Lamps::Lamps(double ceiling_height, std::uint64_t seed)
    : lit_(kEachWay * kEachWay), nodes_(static_cast<std::size_t>(kNodes * kNodes)) {
    for (std::size_t i = 0; i < lit_.size(); ++i) {
        lit_[i] = unit_of(hash(seed, i)) > 0.2;
    }
    const Pattern unevenness(kNodes, 8, 2, 0.5F, hash(seed, 7));
    const double step = kEachWay * kSpacing / kNodes;
    double mean = 0.0;
    for (int node = 0; node < kNodes * kNodes; ++node) {
        const int column = node % kNodes;
        const int row = node / kNodes;
        const double sum = sum_of_lamps(column * step, row * step, ceiling_height);
        nodes_[static_cast<std::size_t>(node)] = static_cast<float>(sum);
        mean += sum / (kNodes * kNodes);
    }
    for (int node = 0; node < kNodes * kNodes; ++node) {
        float& value = nodes_[static_cast<std::size_t>(node)];
        value /= static_cast<float>(mean > 0.0 ? mean : 1.0);
        value *= 1.0F + 0.05F * unevenness.at(node % kNodes, node / kNodes);
    }
}

double Lamps::sum_of_lamps(double x, double y, double height) const {
    constexpr int kReach = 4;  // lamps; those farther off add next to nothing
    const auto middle_column = static_cast<int>(std::floor(x / kSpacing));
    const auto middle_row = static_cast<int>(std::floor(y / kSpacing));
    double sum = 0.0;
    for (int row = middle_row - kReach; row <= middle_row + kReach; ++row) {
        for (int column = middle_column - kReach; column <= middle_column + kReach; ++column) {
            if (is_lit(column, row)) {
                sum +=
                    irradiance(x - (column + 0.5) * kSpacing, y - (row + 0.5) * kSpacing, height);
            }
        }
    }
    return sum;
}

bool Lamps::is_lit(int column, int row) const {
    static_assert((kEachWay & (kEachWay - 1)) == 0);
    constexpr int kMask = kEachWay - 1;
    const int lamp = (row & kMask) * kEachWay + (column & kMask);
    return lit_[static_cast<std::size_t>(lamp)];
}

float Lamps::light(float x, float y) const {
    constexpr float kScale = static_cast<float>(kNodes) / kSpan;
    constexpr int kMask = kNodes - 1;
    const float across = x * kScale;
    const float along = y * kScale;
    const int low_x = floor_of(across);
    const int low_y = floor_of(along);
    const float right = across - static_cast<float>(low_x);
    const float up = along - static_cast<float>(low_y);
    const int column = low_x & kMask;
    const int row = (low_y & kMask) * kNodes;
    const int next_column = (column + 1) & kMask;
    const int next_row = (row + kNodes) & (kNodes * kNodes - 1);
    const float low =
        nodes_[row + column] + right * (nodes_[row + next_column] - nodes_[row + column]);
    const float high = nodes_[next_row + column] +
                       right * (nodes_[next_row + next_column] - nodes_[next_row + column]);
    return low + up * (high - low);
}

float Lamps::glint(float x, float y) const {
    constexpr float kScale = 1.0F / static_cast<float>(kSpacing);
    constexpr float kReach = 1.2F;  // metres, of the blurred image of a lamp
    const int column = floor_of(x * kScale);
    const int row = floor_of(y * kScale);
    if (!is_lit(column, row)) {
        return 0.0F;
    }
    const float dx = (x * kScale - static_cast<float>(column) - 0.5F) / kScale;
    const float dy = (y * kScale - static_cast<float>(row) - 0.5F) / kScale;
    const float falloff = 1.0F / (1.0F + (dx * dx + dy * dy) / (kReach * kReach));
    return falloff * falloff;
}

}  // namespace hybrid_slam
