// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <initializer_list>

namespace hybrid_slam {

/// One message on a classic CAN bus.
struct CanFrame {
    std::uint32_t id = 0;
    bool extended = false;               ///< 29 bits of id, not 11
    bool remote = false;                 ///< asks for `size` bytes, carries none
    std::uint8_t size = 0;               ///< bytes, up to 8
    std::array<std::uint8_t, 8> data{};  ///< zeros from `size` on, all of a remote frame

    /// A data frame with 11 bits of id.
    static CanFrame of(std::uint32_t id, std::initializer_list<std::uint8_t> bytes) {
        CanFrame frame;
        frame.id = id;
        frame.size = static_cast<std::uint8_t>(std::min(bytes.size(), frame.data.size()));
        std::copy_n(bytes.begin(), frame.size, frame.data.begin());
        return frame;
    }

    /// Whether id and size fit on the wire.
    bool valid() const { return id <= (extended ? 0x1FFFFFFFU : 0x7FFU) && size <= 8; }
};

inline bool operator==(const CanFrame& a, const CanFrame& b) {
    return a.id == b.id && a.extended == b.extended && a.remote == b.remote && a.size == b.size &&
           a.data == b.data;
}
inline bool operator!=(const CanFrame& a, const CanFrame& b) {
    return !(a == b);
}

}  // namespace hybrid_slam
