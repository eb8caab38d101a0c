// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "hybrid_slam/backend/keyframe.hpp"
#include "hybrid_slam/backend/loop_closing.hpp"
#include "hybrid_slam/backend/pose_graph.hpp"
#include "hybrid_slam/core/trajectory.hpp"
#include "hybrid_slam/odometry/odometry.hpp"

namespace hybrid_slam {

struct GraphConfig {
    bool enabled = true;              ///< false: odometry alone, no closures and no refinement
    int optimize_every = 10;          ///< keyframes between two refinements while closures come in
    double urgent_correction = 0.15;  ///< metres; a closure that moves this much is refined at once
    RobustKernel kernel = RobustKernel::kCauchy;  ///< on closures
    double kernel_scale = 1.0;                    ///< sigmas
    double outlier_chi2 = 50.0;  ///< closures that end up beyond this are thrown out
};

struct SlamConfig {
    OdometryConfig odometry;
    LoopClosingConfig loop_closing;
    GraphConfig graph;
};

void describe(ConfigSchema& schema, SlamConfig& config);

/// Seconds of the parts of one frame.
struct SlamTimings {
    double odometry = 0.0;
    double loop_closing = 0.0;
    double optimization = 0.0;
    double total() const { return odometry + loop_closing + optimization; }
};

/// What is known after a frame.
struct SlamResult {
    double stamp = 0.0;  ///< of the scan
    Pose2d map_from_robot;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< against the last keyframe: m2, rad2
    OdometryStatus status = OdometryStatus::kFirst;
    PriorKind prior_used = PriorKind::kNone;
    std::optional<double> visual_lag;  ///< seconds the scan is newer than the newest image
    IcpResult icp;
    bool keyframe = false;
    std::vector<Closure> closures;  ///< tried in this frame, and earlier ones that these released
    bool optimized = false;
    SlamTimings timings;
};

/// Everything that a session has learned; what a map folder is written from.
struct SlamMap {
    Keyframes keyframes;
    PoseGraph graph;  ///< node i is keyframe i
    std::vector<Closure> closures;
    Trajectory trajectory;           ///< map_from_robot at every scan, in the order of driving
    Trajectory odometry_trajectory;  ///< the same without the graph
};

/// The pipeline from frames to a map. Single threaded and deterministic.
class Slam {
  public:
    /// Throws Error that names the key for a value out of its range or against another.
    explicit Slam(const SlamConfig& config);
    ~Slam();
    Slam(Slam&&) noexcept;
    Slam& operator=(Slam&&) noexcept;

    SlamResult process(const Frame& frame);

    /// Refines the graph to convergence and throws out closures that do not fit; may be called at
    /// any time, and processing may go on afterwards.
    OptimizeSummary refine();

    /// The map as it stands; call refine first for the best one.
    SlamMap map() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
