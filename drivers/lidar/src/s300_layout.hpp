// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "hybrid_slam/lidar/s300_telegram.hpp"

namespace hybrid_slam {

/// The size rules in the order of the telegrams' lengths, and what they add to 2 * size.
inline constexpr std::array<S300SizeRule, 3> kSizeRules{
    S300SizeRule::kFromByte4, S300SizeRule::kFromByte8, S300SizeRule::kFromByte12};
inline constexpr std::array<std::size_t, 3> kUncountedBytes{4, 8, 14};

inline constexpr std::size_t kHeaderBytes = 20;    ///< before the first block
inline constexpr std::size_t kChecksumBytes = 2;   ///< behind the last one
inline constexpr std::size_t kUncheckedBytes = 4;  ///< at the begin, that no checksum covers
inline constexpr std::size_t kLeastBytes = kHeaderBytes + 4 + kChecksumBytes;
inline constexpr std::uint16_t kChecksumStart = 0xFFFF;

inline std::size_t total_bytes(S300SizeRule rule, std::size_t size_field) {
    return kUncountedBytes[static_cast<std::size_t>(rule)] + 2 * size_field;
}

inline std::uint16_t little_endian16(const std::uint8_t* bytes) {
    return static_cast<std::uint16_t>(bytes[0] | (bytes[1] << 8U));
}

inline std::uint32_t little_endian32(const std::uint8_t* bytes) {
    return little_endian16(bytes) | (static_cast<std::uint32_t>(little_endian16(bytes + 2)) << 16U);
}

/// BeamFlag bits from bits 13 to 15 of a distance word (or 29 to 31 of a reflector's, shifted).
/// Bit 15 is the warning field only before protocol 0x0103.
std::uint8_t beam_flags(unsigned word, std::uint16_t protocol);

/// The checksum of bytes with more of them behind.
std::uint16_t extend_checksum(std::uint16_t checksum, const std::uint8_t* bytes, std::size_t count);

/// Takes a telegram of `total` bytes apart, whose checksum is right, into all but begin, end and
/// size_rule. False when its blocks make no sense.
bool take_apart(const std::uint8_t* bytes, std::size_t total, S300Telegram& telegram);

}  // namespace hybrid_slam
