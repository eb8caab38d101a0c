// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include "hybrid_slam/odometry/local_map.hpp"
#include "hybrid_slam/odometry/motion_prior.hpp"
#include "hybrid_slam/odometry/scan_filter.hpp"
#include "hybrid_slam/registration/icp.hpp"

namespace hybrid_slam {

enum class ReferenceKind {
    kNone,          ///< nothing: the prior alone moves the robot
    kPreviousScan,  ///< the thesis
    kLocalMap
};

struct KeyframeConfig {
    double distance = 0.4;         ///< metres since the last keyframe
    double angle = radians(20.0);  ///< radians since the last keyframe
};

struct OdometryConfig {
    MotionPriorConfig prior;
    ReferenceKind reference = ReferenceKind::kLocalMap;
    ScanFilterConfig filter;
    IcpConfig icp;
    LocalMapConfig local_map;
    KeyframeConfig keyframe;
    double doubtful_overlap = 0.6;  ///< share of matched points below which other starts are tried
    double doubtful_chi2 = 16.0;    ///< disagreement with the prior, likewise
};

void describe(ConfigSchema& schema, OdometryConfig& config);

enum class OdometryStatus {
    kFirst,  ///< nothing to align to yet
    kAligned,
    kPriorOnly,    ///< ICP failed: the motion is the prior's
    kDeadReckoned  ///< ICP was not asked: the motion is the prior's
};
std::string_view to_string(OdometryStatus status);

/// What was learned from one frame. The frame `local` starts at the first pose and drifts.
struct OdometryResult {
    OdometryStatus status = OdometryStatus::kFirst;
    Pose2d local_from_robot;
    Pose2d before_from_now;  ///< motion since the frame before
    PriorKind prior_used = PriorKind::kNone;
    /// Seconds by which the scan is newer than the newest image; empty before the first image.
    std::optional<double> visual_lag;
    /// By how much scans and visual priors contradict each other lately, beyond what both claim: 1
    /// and less is as it should be; the prior's covariance is widened by it. Much more speaks of a
    /// camera that is mounted otherwise than it is said to be.
    double visual_doubt = 0.0;
    IcpResult icp;
    /// Of (x, y, heading) of local_from_robot against the last keyframe, in the axes of local, by
    /// ICP and prior together; grows with every frame that only the prior carries.
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    bool keyframe = false;  ///< moved far enough since the last keyframe
    Surface surface;        ///< of this scan, in the robot's frame
};

/// One scan and what came with it in, one motion out.
class Odometry {
  public:
    explicit Odometry(const OdometryConfig& config);

    OdometryResult register_frame(const Frame& frame);

  private:
    void locate(const Frame& frame, MotionPrior prior, OdometryResult& result) const;
    Eigen::Matrix3d covariance_of(const OdometryResult& result, const MotionPrior& prior) const;
    Eigen::Matrix3d prior_covariance(const MotionPrior& prior,
                                     const Pose2d& local_from_robot) const;
    Eigen::Matrix3d covariance_carried_to(const Pose2d& local_from_robot) const;
    IcpGuess guess_from(const MotionPrior& prior) const;
    MotionPrior doubted(MotionPrior prior) const;
    double contradiction(const MotionPrior& prior, const IcpResult& icp) const;
    IcpResult align_from(const Surface& surface, const MotionPrior& prior) const;
    bool is_doubtful(const IcpResult& icp, const MotionPrior& prior) const;
    bool is_keyframe(const Pose2d& local_from_robot) const;
    const std::optional<Reference>& reference() const;

    OdometryConfig config_;
    MotionPredictor predictor_;
    LocalMap local_map_;
    std::optional<Pose2d> local_from_robot_;
    Eigen::Matrix3d covariance_ = Eigen::Matrix3d::Zero();
    Pose2d local_from_keyframe_;
    double visual_doubt_ = 0.0;
};

}  // namespace hybrid_slam
