// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <random>
#include <string_view>
#include <vector>

#include "hybrid_slam/lidar/s300_telegram.hpp"

namespace hybrid_slam::test {

using Bytes = std::vector<std::uint8_t>;

/// Bytes from hexadecimal digits and blanks.
inline Bytes hex(std::string_view text) {
    Bytes bytes;
    unsigned value = 0;
    int digits = 0;
    for (const char letter : text) {
        if (letter == ' ') {
            continue;
        }
        value =
            16 * value + static_cast<unsigned>(letter <= '9' ? letter - '0' : letter - 'A' + 10);
        if (++digits == 2) {
            bytes.push_back(static_cast<std::uint8_t>(value));
            value = 0;
            digits = 0;
        }
    }
    return bytes;
}

/// The short telegrams of the facts: 150, 0x2000|151, 0x4000|152, 0x8000|153, 2996.
inline Bytes short_0103() {
    return hex(
        "00 00 00 00 00 00 00 0B FF 07 03 01 00 00 45 23 01 00 77 06 BB BB 11 11 96 00 97 20 98 40 "
        "99 80 B4 0B 5E 85");
}
inline Bytes short_0102() {
    return hex(
        "00 00 00 00 00 00 00 10 FF 07 02 01 00 00 45 23 01 00 77 06 BB BB 11 11 96 00 97 20 98 40 "
        "99 80 B4 0B 86 60");
}

inline S300Telegram telegram_of(std::uint32_t scan_number,
                                std::vector<std::uint16_t> words = {100, 200}) {
    S300Telegram telegram;
    telegram.scan_number = scan_number;
    telegram.telegram_number = static_cast<std::uint16_t>(scan_number / 2);
    telegram.field = 1;
    telegram.words = std::move(words);
    return telegram;
}

inline Bytes joined(std::initializer_list<Bytes> parts) {
    Bytes all;
    for (const Bytes& part : parts) {
        all.insert(all.end(), part.begin(), part.end());
    }
    return all;
}

inline void append(Bytes& stream, const Bytes& more) {
    stream.insert(stream.end(), more.begin(), more.end());
}

inline std::vector<S300Telegram> fetch_all(S300Decoder& decoder) {
    std::vector<S300Telegram> telegrams;
    S300Telegram telegram;
    while (decoder.next(telegram)) {
        telegrams.push_back(telegram);
    }
    return telegrams;
}

struct Decoded {
    std::vector<S300Telegram> telegrams;
    S300StreamCounts counts;
};

/// In pieces of 1 to `most` bytes.
inline Decoded decode(const Bytes& stream, std::size_t most, unsigned seed = 1) {
    std::mt19937 rng(seed);
    S300Decoder decoder;
    Decoded decoded;
    for (std::size_t at = 0; at < stream.size();) {
        const std::size_t piece = std::min<std::size_t>(stream.size() - at, 1 + rng() % most);
        decoder.push(stream.data() + at, piece);
        at += piece;
        for (S300Telegram& telegram : fetch_all(decoder)) {
            decoded.telegrams.push_back(std::move(telegram));
        }
    }
    decoded.counts = decoder.counts();
    return decoded;
}

inline Decoded decode(const Bytes& stream) {
    S300Decoder decoder;
    decoder.push(stream.data(), stream.size());
    return {fetch_all(decoder), decoder.counts()};
}

inline std::vector<std::uint32_t> scan_numbers(const Decoded& decoded) {
    std::vector<std::uint32_t> numbers;
    for (const S300Telegram& telegram : decoded.telegrams) {
        numbers.push_back(telegram.scan_number);
    }
    return numbers;
}

/// Bytes that at least one telegram covers.
inline std::uint64_t covered_bytes(const Decoded& decoded) {
    std::vector<bool> covered(decoded.counts.bytes);
    for (const S300Telegram& telegram : decoded.telegrams) {
        std::fill(covered.begin() + static_cast<std::ptrdiff_t>(telegram.begin),
                  covered.begin() + static_cast<std::ptrdiff_t>(telegram.end), true);
    }
    return static_cast<std::uint64_t>(std::count(covered.begin(), covered.end(), true));
}

inline std::uint64_t pending_bytes(const Decoded& decoded) {
    return decoded.counts.bytes - decoded.counts.garbage_bytes - covered_bytes(decoded);
}

}  // namespace hybrid_slam::test
