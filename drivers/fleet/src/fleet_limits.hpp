// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace hybrid_slam {

inline constexpr double kLeastStateInterval = 0.1;  // s, however much happens
inline constexpr double kMostSilence = 2.0;         // s without a status of the drive
inline constexpr double kHeldAfter = 1.0;           // s that a drive may stop to think
inline constexpr std::size_t kMostProblems = 10;    // in a state; the oldest go

}  // namespace hybrid_slam
