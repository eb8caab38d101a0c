// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

namespace hybrid_slam::test {

/// The level of a line that carries `bytes` as 8N1 (start bit low, data bits from the lowest one,
/// stop bit high), one entry for each bit, with `idle` bits of rest before and behind.
inline std::vector<bool> line_levels(const std::vector<std::uint8_t>& bytes, std::size_t idle) {
    std::vector<bool> levels(idle, true);
    for (const std::uint8_t byte : bytes) {
        levels.push_back(false);
        for (int bit = 0; bit < 8; ++bit) {
            levels.push_back((byte >> bit & 1) != 0);
        }
        levels.push_back(true);
    }
    levels.insert(levels.end(), idle, true);
    return levels;
}

enum class FramingErrors { kDropped, kDelivered };

/// What a UART makes of a line sent at `sent_baud` when it is set to `read_baud`: it waits for the
/// line to fall, looks at the middle of each bit by its own rate, and misses the stop bit or not.
inline std::vector<std::uint8_t> received(const std::vector<bool>& levels, double sent_baud,
                                          double read_baud, FramingErrors errors) {
    const double bit = sent_baud / read_baud;  // in bits of the sender
    // Sixteen looks in a bit of the faster one, as UARTs take.
    const double look = std::fmin(1.0, bit) / 16.0;
    const auto level = [&levels](double time) {
        const auto at = static_cast<std::size_t>(time);
        return at >= levels.size() || levels[at];
    };
    std::vector<std::uint8_t> bytes;
    const auto end = static_cast<double>(levels.size());
    bool before = true;
    for (double time = 0.0; time < end; time += look) {
        const bool fell = before && !level(time);
        before = level(time);
        if (!fell || level(time + 0.5 * bit)) {
            continue;
        }
        unsigned byte = 0;
        for (int i = 0; i < 8; ++i) {
            byte |= level(time + (1.5 + i) * bit) ? 1u << i : 0u;
        }
        time += 9.5 * bit;
        before = level(time);
        if (before || errors == FramingErrors::kDelivered) {
            bytes.push_back(static_cast<std::uint8_t>(byte));
        }
    }
    return bytes;
}

}  // namespace hybrid_slam::test
