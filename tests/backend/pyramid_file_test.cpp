// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "byte_codec.hpp"
#include "hybrid_slam/core/error.hpp"
#include "map_files.hpp"
#include "map_support.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

using namespace test;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(PyramidFile, EveryTruncationAndFlippedBitIsRefusedOrHarmless) {
    const TempFolder folder;
    const LikelihoodPyramid pyramid = search_pyramid({{0.0, 0.0}, {1.7, 0.9}});
    write_pyramid(folder / "all", pyramid);
    const std::string bytes = bytes_of(folder / "all");
    for (std::size_t size = 0; size < bytes.size(); ++size) {
        overwrite(folder / "part", bytes.substr(0, size));
        EXPECT_THROW(read_pyramid(folder / "part"), Error) << size << " bytes";
    }
    overwrite(folder / "part", bytes + "x");
    EXPECT_THAT(error_of([&] { read_pyramid(folder / "part"); }), HasSubstr("too many"));
    std::size_t read = 0;
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
        overwrite(folder / "bad", flipped(bytes, bit / 8, bit % 8));
        try {
            const LikelihoodPyramid found = read_pyramid(folder / "bad");
            EXPECT_EQ(found.finest().size(), pyramid.finest().size());
            ++read;
        } catch (const Error& error) {
            EXPECT_THAT(error.what(), HasSubstr("/bad: "));
        }
    }
    // Resolution, origin and levels are numbers like others; the manifest tells those.
    EXPECT_LT(read, 8U * (3 * 8 + 4));
}

TEST(PyramidFile, LayoutIsTheOneInTheDocumentation) {
    const TempFolder folder;
    GridGeometry geometry;
    geometry.resolution = 1.0;
    geometry.origin = {-2.0, 2.0};
    geometry.width = 2;
    geometry.height = 1;
    write_pyramid(folder / "one", LikelihoodPyramid(geometry, {7, 255}, 1));
    using namespace std::string_literals;
    const std::string head = "HSPYRAMD\x01\0\0\0"s + "\0\0\0\0\0\0\xF0\x3F"s +
                             "\0\0\0\0\0\0\0\xC0"s + "\0\0\0\0\0\0\0\x40"s + "\x02\0\0\0"s +
                             "\x01\0\0\0"s + "\x01\0\0\0"s;
    const std::string bytes = bytes_of(folder / "one");
    EXPECT_EQ(bytes.substr(0, head.size()), head);
    EXPECT_EQ(static_cast<std::size_t>(bytes[head.size()]), bytes.size() - head.size() - 4);
    EXPECT_EQ(bytes[head.size() + 4], '\x78');  // zlib's own mark
    EXPECT_EQ(read_pyramid(folder / "one").finest(), (std::vector<std::uint8_t>{7, 255}));
    EXPECT_EQ(read_pyramid(folder / "one").at(0, 1, 0), 255);
}

TEST(PyramidFile, RefusesSizesThatCannotBe) {
    const TempFolder folder;
    GridGeometry geometry;
    geometry.width = 2;
    geometry.height = 2;
    EXPECT_THROW(LikelihoodPyramid(geometry, {1, 2, 3}, 1), Error);
    EXPECT_THROW(LikelihoodPyramid(geometry, {1, 2, 3, 4}, 0), Error);
    EXPECT_THROW(LikelihoodPyramid(geometry, {1, 2, 3, 4}, 13), Error);
    EXPECT_THROW(LikelihoodPyramid(GridGeometry{}, {}, 1), Error);
    write_pyramid(folder / "all", LikelihoodPyramid(geometry, {1, 2, 3, 4}, 1));
    const std::string bytes = bytes_of(folder / "all");
    constexpr std::size_t kWidth = 8 + 4 + 3 * 8;
    for (const std::size_t at : {kWidth, kWidth + 3, kWidth + 4, kWidth + 7, kWidth + 8}) {
        overwrite(folder / "bad", flipped(bytes, at, 6));
        EXPECT_THAT(error_of([&] { read_pyramid(folder / "bad"); }), HasSubstr("damaged"));
    }
}

struct Head {
    double resolution = 0.1;
    Point2 origin = Point2::Zero();
    std::size_t width = 4;
    std::size_t height = 4;
    std::size_t levels = 1;
};

/// A file with that head and a stream of so many bytes after it.
void write_head(const fs::path& file, const Head& head, std::size_t packed) {
    ByteWriter out(file.string());
    out.put_text("HSPYRAMD");
    out.put_count(1);
    out.put_double(head.resolution);
    out.put_double(head.origin.x());
    out.put_double(head.origin.y());
    out.put_count(head.width);
    out.put_count(head.height);
    out.put_count(head.levels);
    out.put_count(packed);
    out.put_text(std::string(packed, 'x'));
    overwrite(file, out.bytes());
}

TEST(PyramidFile, ASizeIsRefusedBeforeThereIsMemoryForIt) {
    const TempFolder folder;
    const auto error = [&](const Head& head) {
        write_head(folder / "bad", head, 600000);
        return error_of([&] { read_pyramid(folder / "bad"); });
    };
    const std::size_t most = std::numeric_limits<std::uint32_t>::max();
    const auto refused = AllOf(HasSubstr("/bad: "), HasSubstr("no pyramid of that size"));
    EXPECT_THAT(error({0.1, {0, 0}, 16384, 16384, 12}), refused);
    EXPECT_THAT(error({0.1, {0, 0}, 8192, 4097, 1}), refused);
    EXPECT_THAT(error({0.1, {0, 0}, most, most, 1}), refused);
    EXPECT_THAT(error({0.1, {0, 0}, most, 1, 1}), refused);
    EXPECT_THAT(error({0.1, {0, 0}, 4, 4, 13}), refused);
    EXPECT_THAT(error({0.1, {0, 0}, 4, 4, most}), refused);
    EXPECT_THAT(error({1e-9, {0, 0}, 4, 4, 1}), refused);
    EXPECT_THAT(error({-0.1, {0, 0}, 4, 4, 1}), refused);
    EXPECT_THAT(error({0.1, {0, 0}, 4, 4, 1}), HasSubstr("does not expand"));
}

TEST(PyramidFile, LevelsThatTheRimIsTooNarrowForAreRefused) {
    const TempFolder folder;
    const LikelihoodPyramid pyramid = search_pyramid({{0.0, 0.0}, {1.7, 0.9}});
    write_pyramid(folder / "all", pyramid);
    std::string bytes = bytes_of(folder / "all");
    constexpr std::size_t kLevels = 8 + 4 + 3 * 8 + 2 * 4;
    ASSERT_EQ(bytes[kLevels], pyramid.levels());
    bytes[kLevels] = 8;
    overwrite(folder / "bad", bytes);
    EXPECT_THAT(error_of([&] { read_pyramid(folder / "bad"); }),
                AllOf(HasSubstr("/bad: damaged"), HasSubstr("rim"), Not(HasSubstr("\n"))));
}

TEST(PyramidFile, BytesThatAreMadeUpDoNoHarm) {
    const TempFolder folder;
    const LikelihoodPyramid pyramid = search_pyramid({{0.0, 0.0}, {1.7, 0.9}});
    write_pyramid(folder / "all", pyramid);
    const std::string bytes = bytes_of(folder / "all");
    constexpr std::array<unsigned char, 6> kExtremes{0x00, 0x01, 0x7F, 0x80, 0xF0, 0xFF};
    std::mt19937 random(5);
    for (int i = 0; i < 4000; ++i) {
        std::string bad = bytes;
        // Half of them in the head, where the numbers are.
        const std::size_t end = i % 2 == 0 ? std::size_t{52} : bad.size();
        const std::size_t first = 12 + random() % (end - 12);
        for (std::size_t at = first; at < std::min(end, first + 1 + random() % 8); ++at) {
            bad[at] = static_cast<char>(kExtremes[random() % kExtremes.size()]);
        }
        overwrite(folder / "bad", bad);
        try {
            const LikelihoodPyramid found = read_pyramid(folder / "bad");
            ASSERT_EQ(found.finest().size(), pyramid.finest().size());
        } catch (const Error& error) {
            ASSERT_THAT(error.what(), HasSubstr("/bad: "));
        }
    }
}

}  // namespace
}  // namespace hybrid_slam
