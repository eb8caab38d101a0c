// SPDX-License-Identifier: Apache-2.0
#include "canvas.hpp"

#include <cmath>

#include "hash.hpp"

namespace hybrid_slam {
namespace {

float smooth(float t) {
    return t * t * (3.0F - 2.0F * t);
}

}  // namespace

Pattern::Pattern(int side, int lattice, int octaves, float fade, std::uint64_t seed)
    : mask_(side - 1), values_(static_cast<std::size_t>(side) * static_cast<std::size_t>(side)) {
    float weight = 1.0F;
    for (int octave = 0; octave < octaves && (lattice << octave) <= side; ++octave) {
        add_octave(lattice << octave, weight, hash(seed, static_cast<std::uint64_t>(octave)));
        weight *= fade;
    }
    normalize();
}

void Pattern::add_octave(int lattice, float weight, std::uint64_t seed) {
    const int side = mask_ + 1;
    const int cell = side / lattice;
    const auto points = static_cast<std::size_t>(lattice);
    std::vector<float> knots(points * points);
    for (std::size_t i = 0; i < knots.size(); ++i) {
        knots[i] = weight * static_cast<float>(2.0 * unit_of(hash(seed, i)) - 1.0);
    }
    std::vector<float> ramp(static_cast<std::size_t>(cell));
    for (int i = 0; i < cell; ++i) {
        ramp[static_cast<std::size_t>(i)] =
            smooth(static_cast<float>(i) / static_cast<float>(cell));
    }
    for (int y = 0; y < side; ++y) {
        const float* low = knots.data() + y / cell * lattice;
        const float* high = knots.data() + (y / cell + 1) % lattice * lattice;
        const float up = ramp[static_cast<std::size_t>(y % cell)];
        float* row = &values_[static_cast<std::size_t>(y) * static_cast<std::size_t>(side)];
        for (int knot = 0; knot < lattice; ++knot) {
            const int next = (knot + 1) % lattice;
            const float left = low[knot] + up * (high[knot] - low[knot]);
            const float right = low[next] + up * (high[next] - low[next]);
            for (int i = 0; i < cell; ++i) {
                row[knot * cell + i] += left + ramp[static_cast<std::size_t>(i)] * (right - left);
            }
        }
    }
}

void Pattern::normalize() {
    double sum = 0.0;
    double squares = 0.0;
    for (const float value : values_) {
        sum += static_cast<double>(value);
        squares += static_cast<double>(value) * static_cast<double>(value);
    }
    const double mean = sum / static_cast<double>(values_.size());
    const double variance = squares / static_cast<double>(values_.size()) - mean * mean;
    const auto scale = static_cast<float>(1.0 / std::sqrt(std::max(variance, 1e-12)));
    for (float& value : values_) {
        value = (value - static_cast<float>(mean)) * scale;
    }
}

void Canvas::modulate(const Pattern& pattern, float strength, int dx, int dy) {
    for (int y = 0; y < side_; ++y) {
        for (int x = 0; x < side_; ++x) {
            Color& color = at(x, y);
            color = color * (1.0F + strength * pattern.at(x + dx, y + dy));
        }
    }
}

}  // namespace hybrid_slam
