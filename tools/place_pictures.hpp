// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "figure.hpp"
#include "hybrid_slam/localization/localizer.hpp"

namespace hybrid_slam::tools {

/// A map with the places where a robot may be, and what it saw drawn as seen from the first.
struct PlacesPicture {
    std::string title;
    std::string subtitle;
    const ReferenceMap& map;
    const Relocalization& answer;
    const Query& query;
};
Canvas draw(const PlacesPicture& picture);

/// A pose on the way through a map.
struct WayPoint {
    Pose2d map_from_robot;
    LocalizationStatus status = LocalizationStatus::kTracking;
    bool follows = true;  ///< on the one before, without a gap or a jump
};

/// A map with the way driven in it, coloured by status.
struct WayPicture {
    std::string title;
    std::string subtitle;
    const ReferenceMap& map;
    const std::vector<WayPoint>& way;
    const std::vector<Jump>& jumps;
};
Canvas draw(const WayPicture& picture);

}  // namespace hybrid_slam::tools
