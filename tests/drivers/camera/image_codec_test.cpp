// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/camera/image_codec.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>

#include "images.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

using test::blank_image;
using test::error_of;
using test::noise_image;
using test::ramp_image;
using ::testing::HasSubstr;

ImageColor color_of(const Image& image) {
    return image.channels == 1 ? ImageColor::kGray : ImageColor::kBgr;
}

int worst_difference(const Image& a, const Image& b) {
    EXPECT_EQ(a.width, b.width);
    EXPECT_EQ(a.height, b.height);
    EXPECT_EQ(a.channels, b.channels);
    if (a.pixels.size() != b.pixels.size()) {
        return 1000;
    }
    int worst = 0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
        worst = std::max(worst, std::abs(a.pixels[i] - b.pixels[i]));
    }
    return worst;
}

EncodedImage png_of(const Image& image) {
    png_image codec{};
    codec.version = PNG_IMAGE_VERSION;
    codec.width = static_cast<png_uint_32>(image.width);
    codec.height = static_cast<png_uint_32>(image.height);
    codec.format = image.channels == 1 ? PNG_FORMAT_GRAY : PNG_FORMAT_BGR;
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(codec);
    EncodedImage bytes(size);
    EXPECT_NE(
        png_image_write_to_memory(&codec, bytes.data(), &size, 0, image.pixels.data(), 0, nullptr),
        0);
    bytes.resize(size);
    return bytes;
}

EncodedImage bytes_of(const std::string& text) {
    return {text.begin(), text.end()};
}

class Formats : public ::testing::TestWithParam<int> {};

TEST_P(Formats, PnmComesBackToTheBit) {
    for (const int width : {1, 3, 64, 101}) {
        const Image image = noise_image(width, 17, GetParam());
        const auto back = decode_image(encode_pnm(image), color_of(image));
        ASSERT_TRUE(back);
        EXPECT_EQ(worst_difference(image, *back), 0);
    }
}

TEST_P(Formats, PngComesBackToTheBit) {
    const Image image = noise_image(53, 17, GetParam());
    const auto back = decode_image(png_of(image), color_of(image));
    ASSERT_TRUE(back);
    EXPECT_EQ(worst_difference(image, *back), 0);
}

TEST_P(Formats, JpegComesBackNearly) {
    const Image image = ramp_image(64, 48, GetParam());
    const auto back = decode_image(encode_jpeg(image, 95), color_of(image));
    ASSERT_TRUE(back);
    EXPECT_LE(worst_difference(image, *back), 6);
}

INSTANTIATE_TEST_SUITE_P(Channels, Formats, ::testing::Values(1, 3));

TEST(ImageCodec, PnmIsAsItsStandardSays) {
    Image image = blank_image(2, 1, 3);
    image.pixels = {1, 2, 3, 4, 5, 6};
    EXPECT_EQ(encode_pnm(image), bytes_of("P6\n2 1\n255\n\3\2\1\6\5\4"));
    image = blank_image(1, 2, 1);
    image.pixels = {7, 8};
    EXPECT_EQ(encode_pnm(image), bytes_of("P5\n1 2\n255\n\7\10"));
}

TEST(ImageCodec, LowerQualityIsSmaller) {
    const Image image = noise_image(64, 48, 1);
    EXPECT_LT(encode_jpeg(image, 30).size(), encode_jpeg(image, 60).size());
    EXPECT_LT(encode_jpeg(image, 60).size(), encode_jpeg(image, 95).size());
}

TEST(ImageCodec, GrayOfColorIsItsLuma) {
    const Image image = noise_image(40, 30, 3);
    for (const EncodedImage& bytes : {encode_pnm(image), png_of(image)}) {
        const auto gray = decode_image(bytes, ImageColor::kGray);
        ASSERT_TRUE(gray);
        ASSERT_EQ(gray->channels, 1);
        for (std::size_t i = 0; i < gray->pixels.size(); ++i) {
            const double luma = 0.114 * image.pixels[3 * i] + 0.587 * image.pixels[3 * i + 1] +
                                0.299 * image.pixels[3 * i + 2];
            ASSERT_NEAR(gray->pixels[i], luma, 0.6);
        }
    }
}

TEST(ImageCodec, GrayOfAJpegIsItsLumaToo) {
    const Image image = ramp_image(64, 48, 3);
    const auto gray = decode_image(encode_jpeg(image, 95), ImageColor::kGray);
    const auto exact = decode_image(encode_pnm(image), ImageColor::kGray);
    ASSERT_TRUE(gray && exact);
    EXPECT_LE(worst_difference(*gray, *exact), 4);
}

TEST(ImageCodec, ColorOfGrayHasThreeEqualChannels) {
    const Image image = noise_image(40, 30, 1);
    for (const EncodedImage& bytes : {encode_pnm(image), png_of(image)}) {
        const auto color = decode_image(bytes, ImageColor::kBgr);
        ASSERT_TRUE(color);
        ASSERT_EQ(color->channels, 3);
        for (std::size_t i = 0; i < color->pixels.size(); ++i) {
            ASSERT_EQ(color->pixels[i], image.pixels[i / 3]);
        }
    }
}

TEST(ImageCodec, PnmHeadersMayHaveComments) {
    EncodedImage bytes = bytes_of("P5 # gray\n# by hand\n 2\t1 #wide\n255\n");
    bytes.push_back(10);
    bytes.push_back(200);
    const auto image = decode_image(bytes, ImageColor::kGray);
    ASSERT_TRUE(image);
    EXPECT_EQ(image->width, 2);
    EXPECT_THAT(image->pixels, ::testing::ElementsAre(10, 200));
}

TEST(ImageCodec, RefusesWhatIsNoImage) {
    for (const char* text :
         {"", "P", "P5", "P5 2 2 255\n", "P5 2 2 65535\n12345678", "P5 -2 2 255\n1234567",
          "P5 0 2 255\n12345678", "P3 1 1 255\n 1 2 3   ", "P6 99999999999 1 255\n1234567",
          "GIF89a..............", "not an image, but long enough to be looked at"}) {
        EXPECT_FALSE(decode_image(bytes_of(text), ImageColor::kGray)) << text;
    }
}

TEST(ImageCodec, RefusesToEncodeWhatDoesNotFitTogether) {
    Image image = noise_image(8, 8, 1);
    image.width = 9;
    EXPECT_THAT(error_of([&] { encode_pnm(image); }), HasSubstr("9 x 8 pixels"));
    EXPECT_THAT(error_of([&] { encode_jpeg(image, 90); }), HasSubstr("9 x 8 pixels"));
    EXPECT_THAT(error_of([&] { encode_jpeg(noise_image(8, 8, 1), 0); }), HasSubstr("quality"));
    EXPECT_THAT(error_of([&] { encode_pnm(Image()); }), HasSubstr("0 x 0 pixels"));
}

/// With the sizes of its frame header overwritten.
EncodedImage jpeg_that_claims(int width, int height) {
    EncodedImage bytes = encode_jpeg(blank_image(16, 16, 1), 90);
    for (std::size_t i = 0; i + 8 < bytes.size(); ++i) {
        if (bytes[i] == 0xFF && bytes[i + 1] == 0xC0) {
            bytes[i + 5] = static_cast<std::uint8_t>(height >> 8);
            bytes[i + 6] = static_cast<std::uint8_t>(height);
            bytes[i + 7] = static_cast<std::uint8_t>(width >> 8);
            bytes[i + 8] = static_cast<std::uint8_t>(width);
            break;
        }
    }
    return bytes;
}

TEST(ImageCodec, RefusesTinyFilesThatClaimToBeHuge) {
    ASSERT_TRUE(decode_image(jpeg_that_claims(16, 16), ImageColor::kBgr));
    for (const auto& [width, height] :
         {std::pair(60000, 60000), std::pair(8192, 8192), std::pair(65535, 1)}) {
        EXPECT_FALSE(decode_image(jpeg_that_claims(width, height), ImageColor::kBgr)) << width;
        const std::string size = std::to_string(width) + " " + std::to_string(height);
        EXPECT_FALSE(decode_image(bytes_of("P6 " + size + " 255\n123"), ImageColor::kBgr));
    }
}

TEST(ImageCodec, RealImagesOfOneColorAreNotTakenForFalse) {
    const Image black = blank_image(1920, 1080, 1);
    EXPECT_TRUE(decode_image(encode_jpeg(black, 10), ImageColor::kBgr));
    EXPECT_TRUE(decode_image(png_of(black), ImageColor::kBgr));
}

TEST(ImageCodec, ACutJpegIsNoImage) {
    const EncodedImage whole = encode_jpeg(noise_image(24, 16, 3), 80);
    ASSERT_TRUE(decode_image(whole, ImageColor::kBgr));
    for (std::size_t size = 0; size < whole.size(); ++size) {
        const EncodedImage cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
        ASSERT_FALSE(decode_image(cut, ImageColor::kBgr)) << size << " of " << whole.size();
    }
}

TEST(ImageCodec, PaddingOfWebcamsIsForgiven) {
    const Image image = ramp_image(64, 48, 3);
    const EncodedImage whole = encode_jpeg(image, 95);
    EncodedImage inside = whole;
    inside.insert(inside.end() - 2, 20, 0x00);
    EncodedImage behind = whole;
    behind.insert(behind.end(), 4096, 0x00);
    EXPECT_TRUE(decode_image(inside, ImageColor::kBgr));
    EXPECT_TRUE(decode_image(behind, ImageColor::kBgr));
}

TEST(ImageCodec, SurvivesDamageInSilence) {
    const Image image = noise_image(48, 32, 3);
    std::mt19937 random(3);
    ::testing::internal::CaptureStderr();
    int refused = 0;
    for (const EncodedImage& whole : {encode_jpeg(image, 80), png_of(image), encode_pnm(image)}) {
        for (int i = 0; i < 700; ++i) {
            EncodedImage bytes = whole;
            for (int hit = 0; hit < 1 + i % 5; ++hit) {
                // Mostly where the headers are.
                const std::size_t range = i % 2 == 0 ? 200 : bytes.size();
                bytes[random() % std::min(range, bytes.size())] =
                    static_cast<std::uint8_t>(random());
            }
            const auto back =
                decode_image(bytes, i % 3 == 0 ? ImageColor::kGray : ImageColor::kBgr);
            refused += back ? 0 : 1;
            if (back) {
                ASSERT_EQ(back->pixels.size(), static_cast<std::size_t>(back->width) *
                                                   static_cast<std::size_t>(back->height) *
                                                   static_cast<std::size_t>(back->channels));
            }
        }
    }
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
    EXPECT_GT(refused, 500);
}

}  // namespace
}  // namespace hybrid_slam
