// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hybrid_slam/can/can_frame.hpp"

namespace hybrid_slam::can_open {

// The ids that CANopen gives by default; a node's number is added.
inline constexpr std::uint32_t kNetworkManagement = 0x000;
inline constexpr std::uint32_t kEmergency = 0x080;
inline constexpr std::uint32_t kTpdo1 = 0x180;
inline constexpr std::uint32_t kRpdo1 = 0x200;
inline constexpr std::uint32_t kTpdo3 = 0x380;
inline constexpr std::uint32_t kSdoAnswer = 0x580;
inline constexpr std::uint32_t kSdoRequest = 0x600;

/// Network management's commands.
inline constexpr std::uint8_t kStartNode = 0x01;
inline constexpr std::uint8_t kStopNode = 0x02;

inline std::uint32_t id(std::uint32_t function, int node) {
    return function + static_cast<std::uint32_t>(node);
}

inline CanFrame start_node(int node) {
    return CanFrame::of(kNetworkManagement, {kStartNode, static_cast<std::uint8_t>(node)});
}

/// A data frame of ours with at least `size` bytes.
inline bool is(const CanFrame& frame, std::uint32_t id, std::size_t size) {
    return !frame.extended && !frame.remote && frame.id == id && frame.size >= size;
}

}  // namespace hybrid_slam::can_open
