// SPDX-License-Identifier: Apache-2.0
#include <zlib.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "byte_codec.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"
#include "map_files.hpp"

namespace hybrid_slam {
namespace {

constexpr std::string_view kMagic = "HSPYRAMD";
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kMostCells = std::size_t{1} << 25U;  ///< twice what is ever written
constexpr double kFinest = 0.01;                           ///< metres by cell, likewise less
constexpr std::size_t kMostExpansion = 1032;               ///< what a byte of zlib's can become

std::string compressed(const std::filesystem::path& file, const std::vector<std::uint8_t>& cells) {
    uLongf size = compressBound(cells.size());
    std::vector<std::uint8_t> packed(size);
    if (compress2(packed.data(), &size, cells.data(), cells.size(), Z_DEFAULT_COMPRESSION) !=
        Z_OK) {
        throw Error(file.string() + ": the pyramid cannot be compressed");
    }
    return {packed.begin(), packed.begin() + static_cast<std::ptrdiff_t>(size)};
}

std::vector<std::uint8_t> expanded(const ByteReader& reader, std::string_view packed,
                                   std::size_t count) {
    std::vector<std::uint8_t> cells(count);
    uLongf size = count;
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): zlib counts in unsigned bytes
    const auto* const bytes = reinterpret_cast<const Bytef*>(packed.data());
    if (uncompress(cells.data(), &size, bytes, packed.size()) != Z_OK || size != count) {
        reader.fail("damaged: it does not expand to its cells");
    }
    return cells;
}

}  // namespace

void write_pyramid(const std::filesystem::path& file, const LikelihoodPyramid& pyramid) {
    const GridGeometry& geometry = pyramid.geometry();
    const std::string packed = compressed(file, pyramid.finest());
    ByteWriter out(file.string());
    out.put_text(kMagic);
    out.put_count(kVersion);
    out.put_double(geometry.resolution);
    out.put_double(geometry.origin.x());
    out.put_double(geometry.origin.y());
    out.put_count(static_cast<std::size_t>(geometry.width));
    out.put_count(static_cast<std::size_t>(geometry.height));
    out.put_count(static_cast<std::size_t>(pyramid.levels()));
    out.put_count(packed.size());
    out.put_text(packed);
    TextFileWriter writer(file);
    writer.write(out.bytes());
    writer.close();
}

LikelihoodPyramid read_pyramid(const std::filesystem::path& file) {
    ByteReader reader(file);
    reader.expect_head(kMagic, kVersion, "a pyramid");
    GridGeometry geometry;
    geometry.resolution = reader.real();
    geometry.origin.x() = reader.real();
    geometry.origin.y() = reader.real();
    const std::size_t width = reader.number();
    const std::size_t height = reader.number();
    const std::size_t levels = reader.number();
    if (geometry.resolution < kFinest || width < 1 || height < 1 || height > kMostCells / width ||
        levels < 1 || levels > LikelihoodPyramid::kMostLevels) {
        reader.fail("damaged: there is no pyramid of that size");
    }
    geometry.width = static_cast<int>(width);
    geometry.height = static_cast<int>(height);
    const std::size_t packed = reader.count(1);
    if (width * height > kMostExpansion * packed) {
        reader.fail("damaged: it does not expand to its cells");
    }
    std::vector<std::uint8_t> finest = expanded(reader, reader.text(packed), width * height);
    reader.expect_end();
    try {
        return {geometry, std::move(finest), static_cast<int>(levels)};
    } catch (const Error& error) {
        reader.fail(std::string("damaged: ") + error.what());
    }
}

}  // namespace hybrid_slam
