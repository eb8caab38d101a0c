// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/link/messages.hpp"

namespace hybrid_slam {

template <typename Enum, std::size_t Count>
using Words = std::array<std::pair<std::string_view, Enum>, Count>;

inline constexpr Words<LinkRole, 3> kRoleWords = {
    {{"pose", LinkRole::kPose}, {"goal", LinkRole::kGoal}, {"watch", LinkRole::kWatch}}};
inline constexpr Words<LinkPoseStatus, 4> kPoseStatusWords = {
    {{"tracking", LinkPoseStatus::kTracking},
     {"degraded", LinkPoseStatus::kDegraded},
     {"lost", LinkPoseStatus::kLost},
     {"relocalizing", LinkPoseStatus::kRelocalizing}}};
inline constexpr Words<LinkMode, 2> kModeWords = {
    {{"manual", LinkMode::kManual}, {"automatic", LinkMode::kAutomatic}}};
inline constexpr Words<LinkDriveState, 6> kDriveStateWords = {
    {{"idle", LinkDriveState::kIdle},
     {"driving", LinkDriveState::kDriving},
     {"paused", LinkDriveState::kPaused},
     {"stopped", LinkDriveState::kStopped},
     {"arrived", LinkDriveState::kArrived},
     {"fault", LinkDriveState::kFault}}};

/// Throws Error that names `what` and the words there are.
template <typename Enum, std::size_t Count>
Enum value_of(const Words<Enum, Count>& words, std::string_view word, std::string_view what) {
    std::string known;
    for (const auto& [name, value] : words) {
        if (name == word) {
            return value;
        }
        known += (known.empty() ? "" : ", ") + std::string(name);
    }
    throw Error(std::string(what) + ": must be one of " + known);
}

template <typename Enum, std::size_t Count>
std::string_view word_of(const Words<Enum, Count>& words, Enum value) {
    for (const auto& [name, each] : words) {
        if (each == value) {
            return name;
        }
    }
    throw Error("not a value of its enumeration");
}

}  // namespace hybrid_slam
