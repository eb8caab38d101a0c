// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "hybrid_slam/core/measurements.hpp"

namespace hybrid_slam {

using EncodedImage = std::vector<std::uint8_t>;  ///< JPEG, PNG or PNM, which tell themselves apart

/// Pixels on the longer side of an image that is read or written.
inline constexpr int kMostImageSide = 8192;

/// `quality` from 1 to 100. Like encode_pnm throws Error for an image whose sizes do not fit
/// together.
EncodedImage encode_jpeg(const Image& image, int quality);

/// PGM or PPM: the pixels as they are behind a line of text.
EncodedImage encode_pnm(const Image& image);

enum class ImageColor { kGray, kBgr };

/// Empty when the bytes are no image, a damaged one, or claim to hold far more than they can. Reads
/// JPEG, PNG and binary PNM of 8 bits; turns nothing by an orientation tag, which would not fit the
/// camera model. The stamp is left at zero.
std::optional<Image> decode_image(const EncodedImage& bytes, ImageColor color);

}  // namespace hybrid_slam
