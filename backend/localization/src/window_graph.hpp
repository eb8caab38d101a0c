// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>

#include "hybrid_slam/backend/pose_graph.hpp"
#include "pose_belief.hpp"

namespace hybrid_slam {

/// A motion with the covariance of (x, y, heading) in the axes of the pose where it ends.
struct MotionBelief {
    Pose2d before_from_now;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

PoseBelief advanced(const PoseBelief& before, const MotionBelief& motion);

/// What a scan says of the pose, without anything else known: information of (x, y, heading) in the
/// axes of the map. It may be singular.
struct PoseAnchor {
    Pose2d map_from_robot;
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
};

/// Squared Mahalanobis distance of the anchor from the belief, the doubt of both counted.
double chi2(const PoseAnchor& anchor, const PoseBelief& belief);

/// A chain of poses tied by motions, each with an anchor to the map or none, and one prior on the
/// oldest that stands for all before. The newest scan is always a node of the graph that is solved;
/// the next one takes its place unless it is kept.
class WindowGraph {
  public:
    /// `kernel_scale` (sigmas) of the anchors' Cauchy kernel.
    WindowGraph(std::size_t nodes, double kernel_scale)
        : most_nodes_(nodes), kernel_scale_(kernel_scale) {}

    void start(const PoseBelief& belief);

    /// The newest kept node, by all that was known when it was kept.
    const PoseBelief& newest() const { return newest_; }

    /// The pose after `motion` from the newest kept node, by the graph with the anchor.
    PoseBelief add(const MotionBelief& motion, const std::optional<PoseAnchor>& anchor, bool keep);

    const PoseGraph& graph() const { return graph_; }

  private:
    void forget_oldest();

    std::size_t most_nodes_;
    double kernel_scale_;
    PoseGraph graph_;  ///< priors in the order of their nodes; the first one is the past
    PoseBelief newest_;
};

}  // namespace hybrid_slam
