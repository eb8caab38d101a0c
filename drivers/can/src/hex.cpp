// SPDX-License-Identifier: Apache-2.0
#include "hex.hpp"

namespace hybrid_slam {
namespace {

std::optional<std::uint32_t> digit(char letter) {
    if (letter >= '0' && letter <= '9') {
        return static_cast<std::uint32_t>(letter - '0');
    }
    if (letter >= 'A' && letter <= 'F') {
        return static_cast<std::uint32_t>(letter - 'A' + 10);
    }
    if (letter >= 'a' && letter <= 'f') {
        return static_cast<std::uint32_t>(letter - 'a' + 10);
    }
    return std::nullopt;
}

}  // namespace

std::string to_hex(std::uint32_t value, std::size_t digits) {
    std::string text(digits, '0');
    for (std::size_t i = digits; i-- > 0; value >>= 4U) {
        text[i] = "0123456789ABCDEF"[value & 0xFU];
    }
    return text;
}

std::optional<std::uint32_t> parse_hex(std::string_view digits) {
    if (digits.empty() || digits.size() > 8) {
        return std::nullopt;
    }
    std::uint32_t value = 0;
    for (const char letter : digits) {
        const auto next = digit(letter);
        if (!next) {
            return std::nullopt;
        }
        value = (value << 4U) | *next;
    }
    return value;
}

std::string data_to_hex(const CanFrame& frame) {
    std::string text;
    for (std::size_t i = 0; i < frame.size; ++i) {
        text += to_hex(frame.data[i], 2);
    }
    return text;
}

bool parse_data(std::string_view digits, CanFrame& frame) {
    if (digits.size() % 2 != 0 || digits.size() > 2 * frame.data.size()) {
        return false;
    }
    frame.size = static_cast<std::uint8_t>(digits.size() / 2);
    for (std::size_t i = 0; i < frame.size; ++i) {
        const auto byte = parse_hex(digits.substr(2 * i, 2));
        if (!byte) {
            return false;
        }
        frame.data[i] = static_cast<std::uint8_t>(*byte);
    }
    return true;
}

}  // namespace hybrid_slam
