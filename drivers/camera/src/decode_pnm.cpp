// SPDX-License-Identifier: Apache-2.0
#include <cctype>

#include "decoders.hpp"

namespace hybrid_slam {
namespace {

/// Reads the header's numbers: digits behind white space and comments.
class HeaderReader {
  public:
    explicit HeaderReader(const EncodedImage& bytes) : bytes_(bytes) {}

    /// Empty for anything but a number of up to 6 digits.
    std::optional<int> number() {
        skip_space();
        int value = 0;
        int digits = 0;
        while (at_ < bytes_.size() && std::isdigit(bytes_[at_]) != 0 && digits < 7) {
            value = 10 * value + (bytes_[at_] - '0');
            ++at_;
            ++digits;
        }
        return digits > 0 && digits < 7 ? std::optional<int>(value) : std::nullopt;
    }

    /// Where the pixels begin: behind a single white space.
    std::size_t pixels() const { return at_ + 1; }

  private:
    void skip_space() {
        bool comment = false;
        while (at_ < bytes_.size()) {
            const std::uint8_t byte = bytes_[at_];
            comment = byte == '#' || (comment && byte != '\n');
            if (!comment && std::isspace(byte) == 0) {
                return;
            }
            ++at_;
        }
    }

    const EncodedImage& bytes_;
    std::size_t at_ = 2;  // behind P5 or P6
};

void convert(const std::uint8_t* from, int channels, Image& image) {
    const std::size_t count =
        static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
    std::uint8_t* to = image.pixels.data();
    for (std::size_t i = 0; i < count; ++i, from += channels, to += image.channels) {
        if (image.channels == 1) {
            to[0] = channels == 1 ? from[0] : luma(from[0], from[1], from[2]);
        } else {
            to[0] = from[channels - 1];  // blue
            to[1] = from[channels / 2];
            to[2] = from[0];
        }
    }
}

}  // namespace

std::optional<Image> decode_pnm(const EncodedImage& bytes, ImageColor color) {
    HeaderReader header(bytes);
    const std::optional<int> width = header.number();
    const std::optional<int> height = header.number();
    const std::optional<int> most = header.number();
    if (!width || !height || most != 255 || *width == 0 || *height == 0 ||
        *width > kMostImageSide || *height > kMostImageSide) {
        return std::nullopt;
    }
    const int channels = bytes[1] == '5' ? 1 : 3;
    const std::size_t size = static_cast<std::size_t>(*width) * static_cast<std::size_t>(*height) *
                             static_cast<std::size_t>(channels);
    if (bytes.size() < header.pixels() + size) {
        return std::nullopt;
    }
    Image image = empty_image(*width, *height, color);
    convert(bytes.data() + header.pixels(), channels, image);
    return image;
}

}  // namespace hybrid_slam
