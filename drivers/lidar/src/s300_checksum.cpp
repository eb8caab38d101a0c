// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "s300_layout.hpp"

namespace hybrid_slam {
namespace {

constexpr std::size_t kSlices = 8;
using Tables = std::array<std::array<std::uint16_t, 256>, kSlices>;

/// Table k holds the remainders of a byte that k zero bytes follow, so that eight bytes take eight
/// look-ups that do not wait for each other.
constexpr Tables make_tables() {
    constexpr unsigned kPolynomial = 0x1021;
    Tables tables{};
    for (unsigned byte = 0; byte < 256; ++byte) {
        unsigned rest = byte << 8U;
        for (int bit = 0; bit < 8; ++bit) {
            rest = (rest << 1U) ^ ((rest & 0x8000U) != 0 ? kPolynomial : 0U);
        }
        tables[0][byte] = static_cast<std::uint16_t>(rest);
    }
    for (std::size_t k = 1; k < kSlices; ++k) {
        for (std::size_t byte = 0; byte < 256; ++byte) {
            const unsigned rest = tables[k - 1][byte];
            tables[k][byte] =
                static_cast<std::uint16_t>((rest << 8U) ^ tables[0][(rest >> 8U) & 0xFFU]);
        }
    }
    return tables;
}

constexpr Tables kTables = make_tables();

}  // namespace

std::uint16_t extend_checksum(std::uint16_t checksum, const std::uint8_t* bytes,
                              std::size_t count) {
    unsigned rest = checksum;
    for (; count >= kSlices; count -= kSlices, bytes += kSlices) {
        rest = static_cast<unsigned>(
            kTables[7][(rest >> 8U) ^ bytes[0]] ^ kTables[6][(rest & 0xFFU) ^ bytes[1]] ^
            kTables[5][bytes[2]] ^ kTables[4][bytes[3]] ^ kTables[3][bytes[4]] ^
            kTables[2][bytes[5]] ^ kTables[1][bytes[6]] ^ kTables[0][bytes[7]]);
    }
    for (; count > 0; --count, ++bytes) {
        rest = ((rest << 8U) & 0xFFFFU) ^ kTables[0][(rest >> 8U) ^ *bytes];
    }
    return static_cast<std::uint16_t>(rest);
}

std::uint16_t s300_checksum(const std::uint8_t* bytes, std::size_t count) {
    return extend_checksum(kChecksumStart, bytes, count);
}

}  // namespace hybrid_slam
