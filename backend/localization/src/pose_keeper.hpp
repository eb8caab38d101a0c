// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "hybrid_slam/localization/localizer.hpp"
#include "pose_belief.hpp"

namespace hybrid_slam {

/// The pose that was told last, carried on by the motion to tell jumps from.
class PoseKeeper {
  public:
    /// The next scan. A motion that no vehicle can make is not believed: odometry aligns scans, and
    /// so may follow even one that was lifted away.
    void carry(double stamp, const Pose2d& before_from_now);
    void hold(const PoseBelief& pose) { pose_ = pose; }

    /// Empty when the pose that was found is where the motion would have it, within the doubt of
    /// the pose that was held. Odometry's own error adds none: where it drifted while the robot was
    /// lost, the pose does jump for who follows it.
    std::optional<Jump> jump_to(const Pose2d& found) const;

  private:
    std::optional<PoseBelief> pose_;
    std::optional<double> stamp_;
    Pose2d motion_;  ///< the last one that was believed
};

}  // namespace hybrid_slam
