// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <cmath>
#include <string>

#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam::test {

/// Matches a pose within metres and radians; a failure prints both poses and how far they are
/// apart.
MATCHER_P3(PoseNear, expected, metres, angle,
           std::string(negation ? "is not" : "is") + " within " + ::testing::PrintToString(metres) +
               " m and " + ::testing::PrintToString(angle) + " rad of " +
               ::testing::PrintToString(expected)) {
    const Pose2d difference = between(static_cast<const Pose2d&>(expected), arg);
    *result_listener << "which is " << difference.translation.norm() << " m and "
                     << std::abs(difference.heading) << " rad away";
    return difference.translation.norm() <= metres && std::abs(difference.heading) <= angle;
}

}  // namespace hybrid_slam::test
