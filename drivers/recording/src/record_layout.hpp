// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <zlib.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

/// The bytes of a record file, little-endian:
///     file header    8 "HSRECORD", u32 version, u32 CRC-32 of the 12 bytes before
///     record header  4 mark, u32 length of the payload, i64 arrival in ns, u32 CRC-32 of the
///                    payload, u32 CRC-32 of the 20 bytes before
///     payload
/// The header has a checksum of its own so that a damaged length, or a mark that stands in a
/// payload by chance, is known at once, without reading what it claims to be long.
namespace hybrid_slam::record_layout {

inline constexpr std::array<std::uint8_t, 8> kMagic{'H', 'S', 'R', 'E', 'C', 'O', 'R', 'D'};
inline constexpr std::uint32_t kVersion = 1;
inline constexpr std::size_t kFileHeader = 16;
inline constexpr std::array<std::uint8_t, 4> kMark{0xD7, 'R', 'E', 'C'};
inline constexpr std::size_t kRecordHeader = 24;

using FileHeader = std::array<std::uint8_t, kFileHeader>;
using RecordHeader = std::array<std::uint8_t, kRecordHeader>;

inline std::uint32_t crc_of(const std::uint8_t* bytes, std::size_t count) {
    return static_cast<std::uint32_t>(crc32_z(0, bytes, count));
}

template <typename Number>
void put(std::uint8_t* to, Number number) {
    const auto bits = static_cast<std::uint64_t>(number);
    for (std::size_t i = 0; i < sizeof(Number); ++i) {
        to[i] = static_cast<std::uint8_t>(bits >> (8U * i));
    }
}

template <typename Number>
Number get(const std::uint8_t* from) {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < sizeof(Number); ++i) {
        bits |= static_cast<std::uint64_t>(from[i]) << (8U * i);
    }
    return static_cast<Number>(bits);
}

inline FileHeader file_header(std::uint32_t version = kVersion) {
    FileHeader header{};
    std::memcpy(header.data(), kMagic.data(), kMagic.size());
    put<std::uint32_t>(header.data() + 8, version);
    put<std::uint32_t>(header.data() + 12, crc_of(header.data(), 12));
    return header;
}

struct RecordFrame {
    std::uint32_t length = 0;
    std::int64_t arrival = 0;  ///< nanoseconds
    std::uint32_t payload_crc = 0;
};

inline RecordHeader encode(const RecordFrame& frame) {
    RecordHeader header{};
    std::memcpy(header.data(), kMark.data(), kMark.size());
    put<std::uint32_t>(header.data() + 4, frame.length);
    put<std::int64_t>(header.data() + 8, frame.arrival);
    put<std::uint32_t>(header.data() + 16, frame.payload_crc);
    put<std::uint32_t>(header.data() + 20, crc_of(header.data(), 20));
    return header;
}

/// False when the bytes are no record header.
inline bool decode(const std::uint8_t* header, RecordFrame& frame) {
    if (std::memcmp(header, kMark.data(), kMark.size()) != 0 ||
        get<std::uint32_t>(header + 20) != crc_of(header, 20)) {
        return false;
    }
    frame.length = get<std::uint32_t>(header + 4);
    frame.arrival = get<std::int64_t>(header + 8);
    frame.payload_crc = get<std::uint32_t>(header + 16);
    return true;
}

inline constexpr double kMostSeconds = 9e9;  ///< what 64 bits of nanoseconds hold

/// Whole seconds apart from the rest, so that a stamp of today comes back to the bit.
inline std::int64_t nanoseconds_of(double seconds) {
    const double whole = std::floor(seconds);
    return static_cast<std::int64_t>(whole) * 1'000'000'000 + std::llround((seconds - whole) * 1e9);
}

inline double seconds_of(std::int64_t nanoseconds) {
    const std::int64_t whole = nanoseconds / 1'000'000'000;
    return static_cast<double>(whole) +
           1e-9 * static_cast<double>(nanoseconds - whole * 1'000'000'000);
}

}  // namespace hybrid_slam::record_layout
