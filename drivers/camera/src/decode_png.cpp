// SPDX-License-Identifier: Apache-2.0
#include <png.h>

#include "decoders.hpp"

namespace hybrid_slam {
namespace {

/// libpng's own conversion has other weights and works in linear light.
Image gray_of(const Image& image) {
    Image gray = empty_image(image.width, image.height, ImageColor::kGray);
    const std::uint8_t* bgr = image.pixels.data();
    for (std::uint8_t& value : gray.pixels) {
        value = luma(bgr[2], bgr[1], bgr[0]);
        bgr += 3;
    }
    return gray;
}

}  // namespace

std::optional<Image> decode_png(const EncodedImage& bytes, ImageColor color) {
    png_image codec{};
    codec.version = PNG_IMAGE_VERSION;
    if (png_image_begin_read_from_memory(&codec, bytes.data(), bytes.size()) == 0) {
        return std::nullopt;
    }
    if (!is_plausible(codec.width, codec.height, bytes.size())) {
        png_image_free(&codec);
        return std::nullopt;
    }
    const bool colored = (codec.format & PNG_FORMAT_FLAG_COLOR) != 0;
    const ImageColor read_as = colored ? ImageColor::kBgr : color;
    codec.format = read_as == ImageColor::kGray ? PNG_FORMAT_GRAY : PNG_FORMAT_BGR;
    Image image =
        empty_image(static_cast<int>(codec.width), static_cast<int>(codec.height), read_as);
    const png_color black{};  // behind what is transparent
    if (png_image_finish_read(&codec, &black, image.pixels.data(), 0, nullptr) == 0) {
        return std::nullopt;  // it has freed the codec
    }
    return read_as == color ? image : gray_of(image);
}

}  // namespace hybrid_slam
