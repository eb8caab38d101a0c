// SPDX-License-Identifier: Apache-2.0
#include "byte_codec.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 32U;

static_assert(std::numeric_limits<float>::is_iec559 && std::numeric_limits<double>::is_iec559);

}  // namespace

template <typename Bits>
void ByteWriter::put_bits(Bits bits) {
    for (std::size_t i = 0; i < sizeof(Bits); ++i) {
        bytes_ += static_cast<char>(static_cast<unsigned char>(bits >> (8U * i)));
    }
}

void ByteWriter::put_count(std::size_t count) {
    if (count > std::numeric_limits<std::uint32_t>::max()) {
        throw Error(fmt::format("{}: {} is too many for this format", file_, count));
    }
    put_bits(static_cast<std::uint32_t>(count));
}

void ByteWriter::put_double(double value) {
    expect_finite(value);
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof(bits));
    put_bits(bits);
}

void ByteWriter::put_pose(const Pose2d& pose) {
    put_double(pose.x());
    put_double(pose.y());
    put_double(pose.heading);
}

void ByteWriter::put_floats(const Points& points) {
    for (const Point2& point : points) {
        put_float(point.x());
        put_float(point.y());
    }
}

void ByteWriter::put_float(double value) {
    // Beyond the range of float the conversion is undefined.
    expect_finite(std::abs(value) <= std::numeric_limits<float>::max() ? value : NAN);
    const auto rounded = static_cast<float>(value);
    std::uint32_t bits = 0;
    std::memcpy(&bits, &rounded, sizeof(bits));
    put_bits(bits);
}

void ByteWriter::expect_finite(double value) const {
    if (!std::isfinite(value)) {
        throw Error(file_ + ": cannot hold a number that is not finite");
    }
}

ByteReader::ByteReader(const std::filesystem::path& file)
    : file_(file.string()), bytes_(read_whole_file(file, kMostBytes)) {}

void ByteReader::fail(const std::string& why) const {
    throw Error(file_ + ": " + why);
}

void ByteReader::expect_head(std::string_view magic, std::uint32_t version, const char* what) {
    if (left() < magic.size() || text(magic.size()) != magic) {
        fail(fmt::format("is no file of {}", what));
    }
    if (const std::uint32_t found = number(); found != version) {
        fail(
            fmt::format("{} of version {}, but only version {} can be read", what, found, version));
    }
}

void ByteReader::expect_end() const {
    if (left() > 0) {
        fail(fmt::format("damaged: {} bytes too many", left()));
    }
}

std::string_view ByteReader::text(std::size_t size) {
    if (left() < size) {
        fail("damaged: it ends too early");
    }
    const std::string_view found = std::string_view(bytes_).substr(at_, size);
    at_ += size;
    return found;
}

template <typename Bits>
Bits ByteReader::bits() {
    const std::string_view raw = text(sizeof(Bits));
    Bits value = 0;
    for (std::size_t i = 0; i < sizeof(Bits); ++i) {
        value |= static_cast<Bits>(static_cast<unsigned char>(raw[i])) << (8U * i);
    }
    return value;
}

std::uint32_t ByteReader::number() {
    return bits<std::uint32_t>();
}

std::size_t ByteReader::count(std::size_t record_bytes) {
    const std::size_t records = number();
    if (records > left() / record_bytes) {
        fail(fmt::format("damaged: {} records cannot be in the {} bytes left", records, left()));
    }
    return records;
}

double ByteReader::real() {
    const auto pattern = bits<std::uint64_t>();
    double value = 0.0;
    std::memcpy(&value, &pattern, sizeof(value));
    return finite(value);
}

Pose2d ByteReader::pose() {
    const double x = real();
    const double y = real();
    return {x, y, real()};
}

Points ByteReader::points(std::size_t count) {
    Points points(count);
    for (Point2& point : points) {
        const double x = small_real();
        point = {x, small_real()};
    }
    return points;
}

double ByteReader::small_real() {
    const auto pattern = bits<std::uint32_t>();
    float value = 0.0F;
    std::memcpy(&value, &pattern, sizeof(value));
    return finite(static_cast<double>(value));
}

double ByteReader::finite(double value) const {
    if (!std::isfinite(value)) {
        fail("damaged: it holds a number that is not finite");
    }
    return value;
}

}  // namespace hybrid_slam
