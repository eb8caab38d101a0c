// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/camera/image_codec.hpp"

#include <string>

#include "decoders.hpp"
#include "encode_jpeg.hpp"
#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

std::size_t count_pixels(const Image& image) {
    return static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
}

void check(const Image& image) {
    const bool sides = image.width > 0 && image.height > 0 && image.width <= kMostImageSide &&
                       image.height <= kMostImageSide;
    const bool channels = image.channels == 1 || image.channels == 3;
    if (!sides || !channels ||
        image.pixels.size() != count_pixels(image) * static_cast<std::size_t>(image.channels)) {
        throw Error("image: " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                    " pixels of " + std::to_string(image.channels) + " channels cannot have " +
                    std::to_string(image.pixels.size()) + " bytes");
    }
}

}  // namespace

bool is_plausible(std::uint64_t width, std::uint64_t height, std::size_t bytes) {
    // Deflate takes 1032 bytes into one; Huffman codes of a JPEG take two blocks of 64 pixels at
    // the least into half a byte.
    constexpr std::uint64_t kMostPixelsPerByte = 2048;
    return width > 0 && height > 0 && width <= kMostImageSide && height <= kMostImageSide &&
           width * height <= kMostPixelsPerByte * bytes;
}

Image empty_image(int width, int height, ImageColor color) {
    Image image;
    image.width = width;
    image.height = height;
    image.channels = color == ImageColor::kGray ? 1 : 3;
    image.pixels.resize(count_pixels(image) * static_cast<std::size_t>(image.channels));
    return image;
}

EncodedImage encode_jpeg(const Image& image, int quality) {
    check(image);
    if (quality < 1 || quality > 100) {
        throw Error("JPEG quality " + std::to_string(quality) + " is not from 1 to 100");
    }
    return compress(image, quality);
}

EncodedImage encode_pnm(const Image& image) {
    check(image);
    const std::string header = (image.channels == 1 ? "P5\n" : "P6\n") +
                               std::to_string(image.width) + " " + std::to_string(image.height) +
                               "\n255\n";
    EncodedImage bytes(header.begin(), header.end());
    bytes.insert(bytes.end(), image.pixels.begin(), image.pixels.end());
    if (image.channels == 3) {
        for (std::size_t i = header.size(); i < bytes.size(); i += 3) {
            std::swap(bytes[i], bytes[i + 2]);  // PPM has red first
        }
    }
    return bytes;
}

std::optional<Image> decode_image(const EncodedImage& bytes, ImageColor color) {
    if (bytes.size() < 8) {
        return std::nullopt;
    }
    if (bytes[0] == 0xFF && bytes[1] == 0xD8) {
        return decode_jpeg(bytes, color);
    }
    if (bytes[0] == 0x89 && bytes[1] == 'P' && bytes[2] == 'N' && bytes[3] == 'G') {
        return decode_png(bytes, color);
    }
    if (bytes[0] == 'P' && (bytes[1] == '5' || bytes[1] == '6')) {
        return decode_pnm(bytes, color);
    }
    return std::nullopt;
}

}  // namespace hybrid_slam
