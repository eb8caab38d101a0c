// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace hybrid_slam::cia402 {

enum class PowerState {
    kNotReady,
    kSwitchOnDisabled,
    kReady,
    kSwitchedOn,
    kEnabled,
    kQuickStop,
    kFaultReaction,
    kFault
};

// Controlwords.
inline constexpr std::uint16_t kDisableVoltage = 0x00;
inline constexpr std::uint16_t kShutdown = 0x06;
inline constexpr std::uint16_t kSwitchOn = 0x07;
inline constexpr std::uint16_t kEnable = 0x0F;
inline constexpr std::uint16_t kFaultReset = 0x80;

// Modes of operation.
inline constexpr std::uint8_t kProfileVelocity = 3;
inline constexpr std::uint8_t kCyclicPosition = 8;

/// Bits 0 to 3, 5 and 6 tell the state; bit 5 only where power could be on.
inline PowerState power_state(unsigned statusword) {
    switch (statusword & 0x4FU) {
        case 0x00:
            return PowerState::kNotReady;
        case 0x40:
            return PowerState::kSwitchOnDisabled;
        case 0x0F:
            return PowerState::kFaultReaction;
        case 0x08:
            return PowerState::kFault;
        default:
            break;
    }
    switch (statusword & 0x6FU) {
        case 0x21:
            return PowerState::kReady;
        case 0x23:
            return PowerState::kSwitchedOn;
        case 0x27:
            return PowerState::kEnabled;
        case 0x07:
            return PowerState::kQuickStop;
        default:
            return PowerState::kNotReady;
    }
}

}  // namespace hybrid_slam::cia402
