// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace hybrid_slam {

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014): neighbours come out unrelated.
constexpr std::uint64_t hash(std::uint64_t value) {
    value += 0x9E3779B97F4A7C15ULL;
    value = (value ^ (value >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    value = (value ^ (value >> 27U)) * 0x94D049BB133111EBULL;
    return value ^ (value >> 31U);
}

constexpr std::uint64_t hash(std::uint64_t a, std::uint64_t b) {
    return hash(hash(a) ^ b);
}
constexpr std::uint64_t hash(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
    return hash(hash(a, b) ^ c);
}

/// In [0, 1).
constexpr double unit_of(std::uint64_t hashed) {
    return static_cast<double>(hashed >> 11U) * (1.0 / 9007199254740992.0);  // 2^-53
}

}  // namespace hybrid_slam
