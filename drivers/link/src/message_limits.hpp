// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hybrid_slam/link/messages.hpp"

namespace hybrid_slam {

/// Both forms of lines and both directions obey these, so that what was taken can be told on.
inline constexpr std::size_t kMostWaypoints = 256;
inline constexpr std::size_t kMostText = 256;  // bytes of a name, a map or a reason

/// Each throws Error "key: what is wanted" for what may not be on the wire.
void check(const LinkHello& hello);
void check(const LinkPose& pose);
void check(const LinkInitialPose& pose);
void check(const LinkGoals& goals);
void check(const LinkStatus& status);

/// Headings into [-pi, pi).
void normalize(LinkPose& pose);
void normalize(LinkGoals& goals);

}  // namespace hybrid_slam
