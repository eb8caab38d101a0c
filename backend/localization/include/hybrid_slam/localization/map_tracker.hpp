// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string_view>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/localization/scan_fit.hpp"
#include "hybrid_slam/odometry/odometry.hpp"

namespace hybrid_slam {

struct TrackingConfig {
    int window = 12;                    ///< keyframes kept in the sliding window
    double node_distance = 0.25;        ///< metres between them, or
    double node_angle = radians(10.0);  ///< radians, or
    double node_seconds = 1.0;          ///< seconds
    double gate = 0.06;                 ///< metres; points farther from the map's walls are left
                                        ///< out, besides the pose's own doubt
    double min_explained = 0.25;        ///< share of the points, below which a scan anchors nothing
    double kernel_scale = 2.0;          ///< sigmas, Cauchy, of the anchors
    /// Metres and radians, sigma by which the map itself may be wrong at any place: in each anchor,
    /// and once more in the covariance, since it is the same in all anchors of a place.
    double translation_floor = 0.0007;
    double rotation_floor = radians(0.007);
    double weak_sigma = 0.05;  ///< metres; less sure than this in a direction is degraded
    double lost_after = 0.7;   ///< seconds of disagreement with the map until lost
    double max_chi2 = 25.0;    ///< of an anchor against the window, beyond which it disagrees
};

void describe(ConfigSchema& schema, TrackingConfig& config);

enum class TrackingStatus {
    kTracking,
    kDegraded,  ///< the place holds, but one direction (or all) rests on odometry alone
    kLost       ///< the map contradicts the pose; final until the next start
};
std::string_view to_string(TrackingStatus status);

/// What was learned from one scan against the map.
struct Track {
    TrackingStatus status = TrackingStatus::kTracking;
    Pose2d map_from_robot;
    /// Of (x, y, heading) of map_from_robot in the axes of the map: m2, m rad, rad2.
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    /// Unit vector in the map along which the pose is least sure.
    Eigen::Vector2d weak_direction = Eigen::Vector2d::Zero();
    ScanFit fit;            ///< at map_from_robot
    bool anchored = false;  ///< the scan gave a constraint to the map
    /// Of what ICP found against what odometry expected, some centimetres forgiven.
    double chi2 = 0.0;
};

/// Keeps the place in a map: odometry edges and map-anchored constraints in a graph over a sliding
/// window, the past marginalised into a prior (thesis section 3.5.4's graph, with the map in it).
class MapTracker {
  public:
    /// Throws Error that names the key for a value out of range.
    MapTracker(std::shared_ptr<const ReferenceMap> map, const TrackingConfig& config,
               const IcpConfig& icp);
    ~MapTracker();
    MapTracker(MapTracker&&) noexcept;
    MapTracker& operator=(MapTracker&&) noexcept;

    /// Forgets all before: the robot is at this pose, with this covariance (axes of the map).
    void start(const Pose2d& map_from_robot, const Eigen::Matrix3d& covariance);

    /// The next scan: what odometry found (its surface, motion, covariance, status) and where the
    /// laser sits. To be called for each scan in order, after start.
    Track track(double stamp, const OdometryResult& odometry, const Pose2d& robot_from_laser);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
