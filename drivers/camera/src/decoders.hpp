// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "hybrid_slam/camera/image_codec.hpp"

namespace hybrid_slam {

// One for each format. They say nothing on stderr, as OpenCV's would (by libjpeg and libpng) for
// each damaged image, and refuse what is damaged instead of filling it up with gray.

std::optional<Image> decode_jpeg(const EncodedImage& bytes, ImageColor color);
std::optional<Image> decode_png(const EncodedImage& bytes, ImageColor color);
std::optional<Image> decode_pnm(const EncodedImage& bytes, ImageColor color);

/// Whether so many bytes can hold an image of this size, by the most that the formats compress an
/// image of a single colour; to be asked before memory is taken for it.
bool is_plausible(std::uint64_t width, std::uint64_t height, std::size_t bytes);

/// The gray of a colour by ITU-R BT.601, as JPEG has it: the same image must have the same grays in
/// each format.
inline std::uint8_t luma(std::uint8_t red, std::uint8_t green, std::uint8_t blue) {
    return static_cast<std::uint8_t>((19595 * red + 38470 * green + 7471 * blue + 32768) >> 16);
}

/// With the pixels still to be filled in.
Image empty_image(int width, int height, ImageColor color);

}  // namespace hybrid_slam
