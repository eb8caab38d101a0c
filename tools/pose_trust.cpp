// SPDX-License-Identifier: Apache-2.0
#include "pose_trust.hpp"

namespace hybrid_slam::tools {
namespace {

/// Halls change, so that much may be new; but walls that are seen through count twice.
bool agrees(const ScanFit& fit) {
    constexpr double kLeastExplained = 0.25;  // share of the beams
    constexpr double kMostViolated = 0.15;
    constexpr double kViolatedWeight = 2.0;
    return fit.explained >= kLeastExplained && fit.violated <= kMostViolated &&
           fit.explained > kViolatedWeight * fit.violated;
}

}  // namespace

void PoseTrust::see(const LocalizationResult& result) {
    const bool held = result.map_from_robot && (result.status == LocalizationStatus::kTracking ||
                                                result.status == LocalizationStatus::kDegraded);
    known_ = held && (known_ || agrees(result.fit));
    sure_ = known_ && result.score > 0.0;
}

}  // namespace hybrid_slam::tools
