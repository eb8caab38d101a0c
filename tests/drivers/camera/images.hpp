// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>

#include "hybrid_slam/core/measurements.hpp"

namespace hybrid_slam::test {

inline Image blank_image(int width, int height, int channels) {
    Image image;
    image.width = width;
    image.height = height;
    image.channels = channels;
    image.pixels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                        static_cast<std::size_t>(channels));
    return image;
}

inline Image noise_image(int width, int height, int channels) {
    Image image = blank_image(width, height, channels);
    std::mt19937 random(7);
    for (std::uint8_t& value : image.pixels) {
        value = static_cast<std::uint8_t>(random());
    }
    return image;
}

/// Different in each channel, so that swapped channels, rows or columns show.
inline Image ramp_image(int width, int height, int channels) {
    Image image = blank_image(width, height, channels);
    std::size_t at = 0;
    for (int row = 0; row < height; ++row) {
        for (int column = 0; column < width; ++column) {
            for (int channel = 0; channel < channels; ++channel) {
                const int value =
                    30 + 60 * channel + 70 * column / width + 10 * (channel + 1) * row / height;
                image.pixels[at++] = static_cast<std::uint8_t>(value);
            }
        }
    }
    return image;
}

}  // namespace hybrid_slam::test
