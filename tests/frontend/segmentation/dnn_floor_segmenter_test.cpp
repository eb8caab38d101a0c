// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/segmentation/dnn_floor_segmenter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "drivers/scratch_folder.hpp"
#include "onnx_file.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

using Color = std::array<std::uint8_t, 3>;  ///< blue, green, red
constexpr Color kDark{20, 20, 20};
constexpr Color kBright{220, 220, 220};
constexpr Color kRed{20, 20, 220};

/// Rows of one colour each.
Image striped(int width, int height, const std::vector<Color>& colors) {
    Image image;
    image.width = width;
    image.height = height;
    image.channels = 3;
    for (int row = 0; row < height; ++row) {
        const auto stripe = static_cast<std::size_t>(row) * colors.size() / height;
        for (int column = 0; column < width; ++column) {
            image.pixels.insert(image.pixels.end(), colors[stripe].begin(), colors[stripe].end());
        }
    }
    return image;
}

/// Sums up the image of a mask by rows; a row that is floor in part counts as -1.
std::vector<int> rows_of(const FloorMask& mask) {
    std::vector<int> rows;
    for (int row = 0; row < mask.height; ++row) {
        const auto first = mask.is_floor.begin() + row * mask.width;
        const int sum = std::accumulate(first, first + mask.width, 0);
        rows.push_back(sum == 0 ? 0 : (sum == mask.width ? 1 : -1));
    }
    return rows;
}

/// What is floor from one row on.
std::vector<int> floor_from(int row, int height) {
    std::vector<int> rows(static_cast<std::size_t>(height), 0);
    std::fill(rows.begin() + row, rows.end(), 1);
    return rows;
}

/// Images go in as numbers from 0 to 1.
SegmentationConfig config_for(const std::filesystem::path& file, int width, int height) {
    SegmentationConfig config;
    config.file = file.string();
    config.input_width = width;
    config.input_height = height;
    config.mean = {0.0};
    config.scale = {1.0 / 255.0};
    config.floor_classes = {1.0};
    return config;
}

class Segmentation : public ::testing::Test {
  protected:
    std::filesystem::path write(const OnnxFile& network) const {
        network.write(folder_ / "tiny.onnx");
        return folder_ / "tiny.onnx";
    }

    /// Class 0 is dark, class 1 bright.
    std::filesystem::path brightness(int width, int height, int stride = 1) const {
        OnnxFile network(width, height);
        network.add_convolution({{-1, -1, -1, 1.5F}, {1, 1, 1, -1.5F}}, stride);
        return write(network);
    }

    /// One channel: how red a pixel is, as a probability.
    std::filesystem::path redness(int width, int height) const {
        OnnxFile network(width, height);
        network.add_convolution({{8, 0, 0, -4}});
        network.add("Sigmoid");
        return write(network);
    }

    const ScratchFolder folder_;
};

TEST_F(Segmentation, TheBestClassTellsFloor) {
    DnnFloorSegmenter segmenter(config_for(brightness(32, 24), 32, 24));
    const FloorMask mask = segmenter.segment(striped(32, 24, {kDark, kBright}));
    EXPECT_EQ(mask.width, 32);
    EXPECT_EQ(mask.height, 24);
    ASSERT_EQ(mask.is_floor.size(), 32U * 24U);
    EXPECT_EQ(rows_of(mask), floor_from(12, 24));
}

TEST_F(Segmentation, OtherClassesAreFloor) {
    SegmentationConfig config = config_for(brightness(32, 24), 32, 24);
    config.floor_classes = {0.0};
    const Image image = striped(32, 24, {kBright, kDark});
    EXPECT_EQ(rows_of(DnnFloorSegmenter(config).segment(image)), floor_from(12, 24));
    config.floor_classes = {0.0, 1.0};
    EXPECT_EQ(rows_of(DnnFloorSegmenter(config).segment(image)), floor_from(0, 24));
}

/// Of three classes two are floor: what counts is the best of them, not their sum.
TEST_F(Segmentation, TheBestOfSeveralFloorClassesCounts) {
    OnnxFile network(16, 30);
    network.add_convolution({{0, 0, 0, 0.6F}, {0.5F, 0.5F, 0, 0}, {0.5F, 0, 0, 0}});
    SegmentationConfig config = config_for(write(network), 16, 30);
    config.floor_classes = {2.0, 1.0};
    const Image image = striped(16, 30, {kDark, kRed, kBright});
    // Red: 0.6 against 0.47 and 0.43; bright: against 0.86 and 0.43.
    EXPECT_EQ(rows_of(DnnFloorSegmenter(config).segment(image)), floor_from(20, 30));
}

TEST_F(Segmentation, OneChannelIsAProbability) {
    SegmentationConfig config = config_for(redness(32, 24), 32, 24);
    const Image image = striped(32, 24, {kDark, kRed});  // 0.03 and 0.95
    EXPECT_EQ(rows_of(DnnFloorSegmenter(config).segment(image)), floor_from(12, 24));
    config.threshold = 0.99;
    EXPECT_EQ(rows_of(DnnFloorSegmenter(config).segment(image)), floor_from(24, 24));
    config.threshold = 0.01;
    EXPECT_EQ(rows_of(DnnFloorSegmenter(config).segment(image)), floor_from(0, 24));
}

TEST_F(Segmentation, RedComesFirstUnlessItIsNotSwapped) {
    SegmentationConfig config = config_for(redness(32, 24), 32, 24);
    const Color blue{220, 20, 20};
    const Image image = striped(32, 24, {blue, kRed});
    EXPECT_EQ(rows_of(DnnFloorSegmenter(config).segment(image)), floor_from(12, 24));
    config.swap_rb = false;
    const Image upside_down = striped(32, 24, {kRed, blue});
    EXPECT_EQ(rows_of(DnnFloorSegmenter(config).segment(upside_down)), floor_from(12, 24));
}

/// The first of three numbers is that of red.
TEST_F(Segmentation, MeanAndScaleAreOfEachChannelInTheNetworksOrder) {
    SegmentationConfig config = config_for(redness(32, 24), 32, 24);
    const Image image = striped(32, 24, {kDark, kRed});
    config.mean = {130.0, 0.0, 0.0};  // (220 - 130) / 255 < 0.5
    EXPECT_EQ(rows_of(DnnFloorSegmenter(config).segment(image)), floor_from(24, 24));
    config.mean = {0.0, 130.0, 130.0};
    EXPECT_EQ(rows_of(DnnFloorSegmenter(config).segment(image)), floor_from(12, 24));
    config.scale = {1.0 / 510.0, 1.0 / 255.0, 1.0 / 255.0};
    EXPECT_EQ(rows_of(DnnFloorSegmenter(config).segment(image)), floor_from(24, 24));
    config.scale = {1.0 / 255.0, 1.0, 1.0};
    EXPECT_EQ(rows_of(DnnFloorSegmenter(config).segment(image)), floor_from(12, 24));
}

TEST_F(Segmentation, ImagesOfAnySizeGetAMaskOfTheirSize) {
    const auto file = brightness(64, 48, 4);  // gives 16 x 12
    DnnFloorSegmenter segmenter(config_for(file, 64, 48));
    for (const auto& [width, height] :
         {std::pair(640, 480), std::pair(64, 48), std::pair(50, 90)}) {
        const FloorMask mask = segmenter.segment(striped(width, height, {kDark, kBright}));
        ASSERT_EQ(mask.width, width);
        ASSERT_EQ(mask.height, height);
        const std::vector<int> rows = rows_of(mask);
        EXPECT_EQ(std::count(rows.begin(), rows.end(), -1), 0);
        const auto border = std::find(rows.begin(), rows.end(), 1) - rows.begin();
        // Every fourth row of the network's input is seen, and so at most two are wrong.
        EXPECT_NEAR(static_cast<double>(border), 0.5 * height, 2.5 * height / 48.0);
        EXPECT_EQ(rows, floor_from(static_cast<int>(border), height));
    }
}

TEST_F(Segmentation, GrayImagesAreTaken) {
    DnnFloorSegmenter segmenter(config_for(brightness(32, 24), 32, 24));
    Image gray;
    gray.width = 32;
    gray.height = 24;
    gray.pixels.assign(32 * 24, 20);
    std::fill(gray.pixels.begin() + 32 * 8, gray.pixels.end(), std::uint8_t{220});
    EXPECT_EQ(rows_of(segmenter.segment(gray)), floor_from(8, 24));
}

TEST_F(Segmentation, SameImageSameMask) {
    const auto file = brightness(64, 48, 2);
    DnnFloorSegmenter first(config_for(file, 64, 48));
    DnnFloorSegmenter second(config_for(file, 64, 48));
    Image image = striped(160, 120, {kDark, kRed, kBright});
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        image.pixels[i] = static_cast<std::uint8_t>(image.pixels[i] + i * i % 30);
    }
    const auto mask = first.segment(image).is_floor;
    second.segment(striped(160, 120, {kBright}));
    EXPECT_EQ(second.segment(image).is_floor, mask);
    EXPECT_EQ(first.segment(image).is_floor, mask);
}

TEST_F(Segmentation, RefusesFilesThatAreNoNetworks) {
    const auto message = [](const std::filesystem::path& file) {
        std::string said = error_of([&] { DnnFloorSegmenter(config_for(file, 32, 24)); });
        EXPECT_EQ(said.find('\n'), std::string::npos) << said;
        return said;
    };
    EXPECT_THAT(message(folder_ / "none.onnx"), HasSubstr("none.onnx: cannot be opened"));
    EXPECT_THAT(message(folder_ / "."), HasSubstr("cannot be"));
    EXPECT_THAT(message(folder_.write("empty.onnx", "")), HasSubstr("empty.onnx: is empty"));
    EXPECT_THAT(message(folder_.write("words.onnx", "These are no layers.\n")),
                HasSubstr("words.onnx: "));
    OnnxFile unknown(32, 24);
    unknown.add("Teleport");
    EXPECT_THAT(message(write(unknown)), HasSubstr("tiny.onnx: not an ONNX network"));
}

/// Wherever the file is cut, it is an error in one line; at most what is left runs as a network.
TEST_F(Segmentation, RefusesTruncatedFiles) {
    OnnxFile network(32, 24);
    network.add_convolution({{-1, -1, -1, 1.5F}, {1, 1, 1, -1.5F}});
    const std::string whole = network.bytes();
    for (std::size_t size = 1; size + 8 < whole.size(); size += 3) {
        const auto file = folder_.write("cut.onnx", whole.substr(0, size));
        const std::string said = error_of([&] { DnnFloorSegmenter(config_for(file, 32, 24)); });
        EXPECT_THAT(said, AllOf(HasSubstr("cut.onnx: "), Not(HasSubstr("\n")))) << size;
    }
}

TEST_F(Segmentation, RefusesOutputThatItDoesNotUnderstandAndSaysItsShape) {
    OnnxFile network(32, 24);
    network.add_convolution({{1, 1, 1, 0}, {0, 0, 0, 1}});
    network.add("GlobalAveragePool");
    network.add("Flatten");
    const auto file = write(network);
    EXPECT_THAT(error_of([&] { DnnFloorSegmenter(config_for(file, 32, 24)); }),
                HasSubstr("tiny.onnx: its output is 1 x 2, and not 1 x classes x height x width"));
}

TEST_F(Segmentation, RefusesConfigsThatDoNotFit) {
    const auto file = brightness(32, 24);
    const auto message = [&](const auto& change) {
        SegmentationConfig config = config_for(file, 32, 24);
        change(config);
        return error_of([&] { DnnFloorSegmenter segmenter(config); });
    };
    EXPECT_THAT(message([](auto& config) { config.file = ""; }), HasSubstr("segmentation.file"));
    EXPECT_THAT(message([](auto& config) { config.floor_classes = {2.0}; }),
                AllOf(HasSubstr("segmentation.floor_classes: 2"), HasSubstr("2 classes")));
    EXPECT_THAT(message([](auto& config) { config.floor_classes = {0.5}; }),
                HasSubstr("segmentation.floor_classes: must hold whole numbers"));
    EXPECT_THAT(message([](auto& config) { config.floor_classes = {}; }),
                HasSubstr("segmentation.floor_classes: must name a class"));
    EXPECT_THAT(message([](auto& config) { config.floor_classes = {-1.0}; }),
                HasSubstr("segmentation.floor_classes"));
    EXPECT_THAT(message([](auto& config) {
                    config.mean = {1.0, 2.0};
                }),
                HasSubstr("segmentation.mean: must hold one number or three"));
    EXPECT_THAT(message([](auto& config) { config.scale = {}; }), HasSubstr("segmentation.scale"));
    EXPECT_THAT(message([](auto& config) { config.input_width = 0; }),
                HasSubstr("segmentation.input_width"));
}

TEST_F(Segmentation, RefusesImagesThatAreNone) {
    DnnFloorSegmenter segmenter(config_for(brightness(32, 24), 32, 24));
    EXPECT_THAT(error_of([&] { segmenter.segment(Image()); }), HasSubstr("segmentation"));
    Image torn = striped(32, 24, {kDark});
    torn.pixels.pop_back();
    EXPECT_THAT(error_of([&] { segmenter.segment(torn); }), HasSubstr("segmentation"));
    Image two = striped(32, 24, {kDark});
    two.channels = 2;
    two.pixels.resize(32 * 24 * 2);
    EXPECT_THAT(error_of([&] { segmenter.segment(two); }), HasSubstr("segmentation"));
}

TEST(SegmentationConfigFile, IsReadBackAsWritten) {
    SegmentationConfig config;
    config.file = "floor.onnx";
    config.floor_classes = {3.0, 6.0};
    config.scale = {0.5};
    config.swap_rb = false;
    ConfigSchema schema;
    describe(schema, config);
    const ScratchFolder folder;
    const auto file = folder.write("s.yaml", schema.to_yaml());
    SegmentationConfig read;
    ConfigSchema reader;
    describe(reader, read);
    reader.load(file);
    EXPECT_EQ(reader.to_yaml(), schema.to_yaml());
    EXPECT_EQ(read.floor_classes, config.floor_classes);
    EXPECT_EQ(read.file, "floor.onnx");
}

}  // namespace
}  // namespace hybrid_slam::test
