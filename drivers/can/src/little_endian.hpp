// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "hybrid_slam/can/can_frame.hpp"

namespace hybrid_slam {

/// Writes the lowest `bytes` of `value` from byte `at` on.
inline void put(CanFrame& frame, std::size_t at, std::int64_t value, std::size_t bytes) {
    for (std::size_t i = 0; i < bytes; ++i) {
        frame.data[at + i] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> 8U * i);
    }
}

inline std::uint32_t unsigned_at(const CanFrame& frame, std::size_t at, std::size_t bytes) {
    std::uint32_t value = 0;
    for (std::size_t i = bytes; i-- > 0;) {
        value = value << 8U | frame.data[at + i];
    }
    return value;
}

inline std::int16_t i16_at(const CanFrame& frame, std::size_t at) {
    return static_cast<std::int16_t>(unsigned_at(frame, at, 2));
}

inline std::int32_t i32_at(const CanFrame& frame, std::size_t at) {
    return static_cast<std::int32_t>(unsigned_at(frame, at, 4));
}

}  // namespace hybrid_slam
