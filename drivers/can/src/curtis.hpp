// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace hybrid_slam::curtis {

// Flags of byte 0 of the command.
inline constexpr std::uint8_t kInterlock = 0x01;
inline constexpr std::uint8_t kForward = 0x02;
inline constexpr std::uint8_t kReverse = 0x04;

inline constexpr double kMostCentidegrees = 12000.0;

}  // namespace hybrid_slam::curtis
