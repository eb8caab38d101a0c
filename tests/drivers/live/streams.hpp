// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

#include "hybrid_slam/lidar/s300_telegram.hpp"

namespace hybrid_slam::test {

using Bytes = std::vector<std::uint8_t>;

/// Of an S300 as it comes, 541 beams.
inline Bytes telegram_bytes(std::uint32_t scan_number) {
    S300Telegram telegram;
    telegram.scan_number = scan_number;
    telegram.telegram_number = static_cast<std::uint16_t>(scan_number / 2);
    telegram.field = 1;
    for (std::uint32_t beam = 0; beam < 541; ++beam) {
        telegram.words.push_back(static_cast<std::uint16_t>(50 + (beam * 37 + scan_number) % 900));
    }
    return encode(telegram);
}

inline void append(Bytes& bytes, const Bytes& more) {
    bytes.insert(bytes.end(), more.begin(), more.end());
}

inline std::vector<std::uint32_t> scan_numbers(const Bytes& bytes) {
    S300Decoder decoder;
    decoder.push(bytes.data(), bytes.size());
    std::vector<std::uint32_t> numbers;
    S300Telegram telegram;
    while (decoder.next(telegram)) {
        numbers.push_back(telegram.scan_number);
    }
    return numbers;
}

/// 2 for each turn that is sent, as scanners count.
inline std::vector<std::uint32_t> numbers_from(std::uint32_t first, std::size_t count) {
    std::vector<std::uint32_t> numbers;
    for (std::size_t i = 0; i < count; ++i) {
        numbers.push_back(first + 2 * static_cast<std::uint32_t>(i));
    }
    return numbers;
}

inline void sleep_ms(int milliseconds) {
    std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
}

/// False when it has not become true in a time that is never needed.
inline bool comes_true(const std::function<bool()>& condition) {
    constexpr int kMilliseconds = 30000;
    for (int waited = 0; waited < kMilliseconds; waited += 2) {
        if (condition()) {
            return true;
        }
        sleep_ms(2);
    }
    return condition();
}

}  // namespace hybrid_slam::test
