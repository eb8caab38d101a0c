// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <ostream>
#include <random>
#include <string>
#include <vector>

#include "hybrid_slam/can/candump.hpp"

namespace hybrid_slam {

/// As candump spells it, so that a failing test says something.
inline void PrintTo(const CanFrame& frame, std::ostream* out) {
    if (frame.valid()) {
        const std::string line = to_candump({0, "x", frame});
        *out << line.substr(line.rfind(' ') + 1);
    } else {
        *out << "invalid frame " << frame.id;
    }
}

namespace test {

/// From "203#0100": an id, # and data.
inline CanFrame frame(const std::string& text) {
    return parse_candump("(0.000000) can0 " + text).frame;
}

/// All that a frame can be.
inline CanFrame random_frame(std::mt19937& rng) {
    const auto draw = [&rng](unsigned most) {
        return std::uniform_int_distribution<unsigned>(0, most)(rng);
    };
    CanFrame frame;
    frame.extended = draw(1) == 1;
    frame.remote = draw(3) == 0;
    frame.id = draw(frame.extended ? 0x1FFFFFFFU : 0x7FFU);
    frame.size = static_cast<std::uint8_t>(draw(8));
    for (std::size_t i = 0; !frame.remote && i < frame.size; ++i) {
        frame.data[i] = static_cast<std::uint8_t>(draw(255));
    }
    return frame;
}

/// One byte put in, taken out or replaced.
inline std::string mutated(std::string text, std::mt19937& rng) {
    const auto draw = [&rng](std::size_t most) {
        return std::uniform_int_distribution<std::size_t>(0, most)(rng);
    };
    const std::size_t at = text.empty() ? 0 : draw(text.size() - 1);
    // Half of them letters that have a meaning, which gets further than noise.
    const char letter = draw(1) == 0 ? "tTrRzZ#.()0F\r\a "[draw(14)] : static_cast<char>(draw(255));
    switch (draw(2)) {
        case 0:
            text.insert(at, 1, letter);
            break;
        case 1:
            text.erase(at, text.empty() ? 0 : 1);
            break;
        default:
            text.replace(at, 1, 1, letter);
    }
    return text;
}

}  // namespace test
}  // namespace hybrid_slam
