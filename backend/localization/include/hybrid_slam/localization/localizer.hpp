// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/core/frame.hpp"
#include "hybrid_slam/localization/map_tracker.hpp"
#include "hybrid_slam/localization/particle_filter.hpp"
#include "hybrid_slam/localization/relocalization.hpp"
#include "hybrid_slam/odometry/odometry.hpp"

namespace hybrid_slam {

struct LocalizationConfig {
    OdometryConfig odometry;
    RelocalizationConfig relocalization;
    ParticleFilterConfig particles;
    TrackingConfig tracking;
    double query_path = 10.0;    ///< metres of the drive that a query of several scans reaches back
    double query_spacing = 0.3;  ///< metres, or
    double query_angle = radians(15.0);  ///< radians between its scans
    double search_every = 0.5;  ///< metres driven between two searches while the place is unknown
};

/// Keys relocalization.*, particles.*, tracking.* and localization.*: all but those of the
/// odometry, for a program that has these already.
void describe_without_odometry(ConfigSchema& schema, LocalizationConfig& config);

/// The same, and those of the odometry as in SlamConfig.
void describe(ConfigSchema& schema, LocalizationConfig& config);

enum class LocalizationStatus {
    kRelocalizing,  ///< not known yet where in the map: searching, or several places are possible
    kTracking,
    kDegraded,  ///< the place holds, but a direction rests on odometry alone
    kLost       ///< the map has just contradicted the pose; the search begins anew
};
std::string_view to_string(LocalizationStatus status);

/// The pose did not follow the motion, or the motion was one that no vehicle makes: both poses are
/// of the same moment.
struct Jump {
    Pose2d from;  ///< map_from_robot as the motion would have it
    Pose2d to;    ///< map_from_robot as it is now held to be
};

/// What is known after a scan.
struct LocalizationResult {
    double stamp = 0.0;  ///< of the scan
    LocalizationStatus status = LocalizationStatus::kRelocalizing;
    /// Empty while the place is unknown. While lost: the pose that the map has just contradicted.
    std::optional<Pose2d> map_from_robot;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< axes of the map: m2, m rad, rad2
    /// 0 to 1, how sure. With a pose: the score of its fit, half of it while a direction (or the
    /// scan) rests on odometry. Searching: the best place's score shared among all that are
    /// possible, or half the share of the particle filter's first. Lost, not in the map: 0.
    double score = 0.0;
    Eigen::Vector2d weak_direction = Eigen::Vector2d::Zero();  ///< in the map
    /// Of the scan at the pose, unmapped beams apart from misfit; while searching, of the query at
    /// the best place. Without points: the scan was blind, and nothing was looked up.
    ScanFit fit;
    std::optional<Jump> jump;
    /// Of a search in this frame, or of the particle filter.
    std::optional<Relocalization> relocalization;
    std::size_t particles = 0;  ///< 0: the filter rests
    PriorKind prior_used = PriorKind::kNone;
    std::optional<double> visual_lag;  ///< seconds
};

/// A pose between two scans, at the rate of the camera.
struct PredictedPose {
    double stamp = 0.0;
    Pose2d map_from_robot;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

/// From frames to poses in a stored map: odometry, global search, particle filter while several
/// places are possible, tracking. Single threaded; deterministic unless relocalization.max_seconds
/// is set.
class Localizer {
  public:
    /// Throws Error that names the key for a value out of range.
    Localizer(std::shared_ptr<const ReferenceMap> map, const LocalizationConfig& config);
    ~Localizer();
    Localizer(Localizer&&) noexcept;
    Localizer& operator=(Localizer&&) noexcept;

    /// Before the first frame, or at any time (VDA 5050 initPosition): the pose at the next scan
    /// from which tracking starts; when the scan contradicts it the search begins. Throws Error for
    /// what is not finite, and for a covariance that is not symmetric and positive.
    void start_at(const Pose2d& map_from_robot, const Eigen::Matrix3d& covariance);

    LocalizationResult process(const Frame& frame);

    /// Carries the pose of the newest scan to the stamp of the newest image. Empty while the place
    /// is not known or vision has a gap since that scan.
    std::optional<PredictedPose> predict(const VisualMotion& motion);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
