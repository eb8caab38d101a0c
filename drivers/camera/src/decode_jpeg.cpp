// SPDX-License-Identifier: Apache-2.0
#include "decoders.hpp"
#include "jpeg_trouble.hpp"

namespace hybrid_slam {
namespace {

/// False when it failed.
bool decode(const EncodedImage& bytes, ImageColor color, Image& image) {
    JpegTrouble trouble;
    jpeg_decompress_struct codec{};
    codec.err = install(trouble);
    if (setjmp(trouble.leave) != 0) {
        jpeg_destroy_decompress(&codec);
        return false;
    }
    jpeg_create_decompress(&codec);
    jpeg_mem_src(&codec, bytes.data(), static_cast<unsigned long>(bytes.size()));
    jpeg_read_header(&codec, TRUE);
    if (!is_plausible(codec.image_width, codec.image_height, bytes.size())) {
        give_up(reinterpret_cast<j_common_ptr>(&codec));
    }
    codec.out_color_space = color == ImageColor::kGray ? JCS_GRAYSCALE : JCS_EXT_BGR;
    jpeg_start_decompress(&codec);
    image = empty_image(static_cast<int>(codec.output_width), static_cast<int>(codec.output_height),
                        color);
    const std::size_t stride = image.pixels.size() / codec.output_height;
    while (codec.output_scanline < codec.output_height && !trouble.damaged) {
        JSAMPROW row = image.pixels.data() + stride * codec.output_scanline;
        jpeg_read_scanlines(&codec, &row, 1);
    }
    if (!trouble.damaged) {
        jpeg_finish_decompress(&codec);
    }
    jpeg_destroy_decompress(&codec);
    return !trouble.damaged;
}

}  // namespace

std::optional<Image> decode_jpeg(const EncodedImage& bytes, ImageColor color) {
    Image image;
    if (!decode(bytes, color, image)) {
        return std::nullopt;
    }
    return image;
}

}  // namespace hybrid_slam
