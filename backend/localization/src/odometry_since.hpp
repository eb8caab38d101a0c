// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid_slam/odometry/odometry.hpp"
#include "window_graph.hpp"

namespace hybrid_slam {

/// What odometry says of the motion since a node that lies at any scan, out of covariances that
/// count from its own last keyframe.
class OdometrySince {
  public:
    /// The node is at this scan.
    explicit OdometrySince(const OdometryResult& node) { pass(node, true); }

    MotionBelief motion(const OdometryResult& now) const;

    /// To be told each scan once, after motion(): `is_node` when it is the next node.
    void pass(const OdometryResult& now, bool is_node);

  private:
    /// All in the axes of local.
    struct Doubt {
        /// Of the place of odometry's last keyframe (or the node), carried on to the newest scan.
        Eigen::Matrix3d until_keyframe = Eigen::Matrix3d::Zero();
        /// Metres, of each direction that scans do not determine: how far odometry may have
        /// slipped.
        Eigen::Matrix2d slip = Eigen::Matrix2d::Zero();
    };
    Doubt carried_to(const OdometryResult& now) const;

    Pose2d local_from_node_;
    Pose2d local_from_before_;  ///< at the scan before
    Doubt doubt_;               ///< there
};

}  // namespace hybrid_slam
