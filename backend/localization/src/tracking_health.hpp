// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "hybrid_slam/localization/map_tracker.hpp"

namespace hybrid_slam {

/// What speaks against the pose besides the fit.
struct Disagreement {
    bool refused = false;  ///< ICP found a pose that disagrees with the window
    /// Odometry reports a motion that no vehicle makes: the scan was matched somewhere else. Lost
    /// at once, even if it fits there too: no jump without somebody who answers for it.
    bool leapt = false;
};

/// Sums up over the scans whether the map contradicts the pose.
class TrackingHealth {
  public:
    explicit TrackingHealth(const TrackingConfig& config) : config_(config) {}

    /// The status after a scan; all of `track` but its status is known. Lost is final.
    TrackingStatus judge(double stamp, const Track& track, const Disagreement& disagreement);

    bool lost() const { return lost_; }

  private:
    /// Shares of the beams.
    struct Level {
        double score = 0.0;  ///< explained less violated
        double violated = 0.0;
    };

    bool contradicts(const ScanFit& fit);
    bool fell_suddenly(const Level& now);

    TrackingConfig config_;
    std::optional<double> stamp_;
    double last_anchor_ = 0.0;
    double doubt_ = 0.0;            ///< seconds of contradiction, less those of agreement
    std::optional<Level> usual_;    ///< of the scans before; where it was before a sudden fall
    std::optional<double> fallen_;  ///< score below which the fall lasts
    bool lost_ = false;
};

}  // namespace hybrid_slam
