// SPDX-License-Identifier: Apache-2.0
#include "encode_jpeg.hpp"

#include <cstdlib>

#include "hybrid_slam/core/error.hpp"
#include "jpeg_trouble.hpp"

namespace hybrid_slam {
namespace {

/// libjpeg's memory, which grows as it writes.
struct Output {
    unsigned char* bytes = nullptr;
    unsigned long size = 0;
};

/// False when it failed.
bool encode(const Image& image, int quality, Output& output) {
    JpegTrouble trouble;
    jpeg_compress_struct codec{};
    codec.err = install(trouble);
    if (setjmp(trouble.leave) != 0) {
        jpeg_destroy_compress(&codec);
        return false;
    }
    jpeg_create_compress(&codec);
    jpeg_mem_dest(&codec, &output.bytes, &output.size);
    codec.image_width = static_cast<JDIMENSION>(image.width);
    codec.image_height = static_cast<JDIMENSION>(image.height);
    codec.input_components = image.channels;
    codec.in_color_space = image.channels == 1 ? JCS_GRAYSCALE : JCS_EXT_BGR;
    jpeg_set_defaults(&codec);
    jpeg_set_quality(&codec, quality, TRUE);
    jpeg_start_compress(&codec, TRUE);
    const std::size_t stride = image.pixels.size() / codec.image_height;
    while (codec.next_scanline < codec.image_height) {
        // libjpeg reads from it alone, whatever its type says.
        const JSAMPLE* row = image.pixels.data() + stride * codec.next_scanline;
        auto* rows = const_cast<JSAMPROW>(row);  // NOLINT(cppcoreguidelines-pro-type-const-cast)
        jpeg_write_scanlines(&codec, &rows, 1);
    }
    jpeg_finish_compress(&codec);
    jpeg_destroy_compress(&codec);
    return true;
}

}  // namespace

EncodedImage compress(const Image& image, int quality) {
    Output output;
    const bool done = encode(image, quality, output);
    EncodedImage bytes;
    if (done) {
        bytes.assign(output.bytes, output.bytes + output.size);
    }
    std::free(output.bytes);
    if (!done) {
        throw Error("JPEG: libjpeg cannot encode the image");
    }
    return bytes;
}

}  // namespace hybrid_slam
