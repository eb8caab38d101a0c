// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/localization/map_tracker.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/uncertainty.hpp"
#include "odometry_since.hpp"
#include "scan_anchor.hpp"
#include "tracking_health.hpp"
#include "window_graph.hpp"

namespace hybrid_slam {
namespace {

Eigen::Matrix3d squared(double translation, double rotation) {
    return Eigen::Vector3d(translation * translation, translation * translation,
                           rotation * rotation)
        .asDiagonal();
}

/// Maps are not rigid: within this, a scan that disagrees with the window is believed little by
/// little, by the kernel; beyond, not at all.
PoseBelief with_leeway(PoseBelief belief) {
    constexpr double kTranslation = 0.02;
    constexpr double kRotation = radians(0.3);
    belief.covariance += squared(kTranslation, kRotation);
    return belief;
}

Eigen::Vector2d weakest_direction(const Eigen::Matrix3d& covariance) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(covariance.topLeftCorner<2, 2>());
    return eigen.eigenvectors().col(1);
}

std::shared_ptr<const ReferenceMap> expect_map(std::shared_ptr<const ReferenceMap> map) {
    if (map == nullptr) {
        throw Error("tracking: there is no map");
    }
    return map;
}

TrackingConfig checked(TrackingConfig config, IcpConfig icp) {
    ConfigSchema schema;  // throws for values out of their ranges
    {
        const ConfigSchema::Section section(schema, "tracking");
        describe(schema, config);
    }
    const ConfigSchema::Section section(schema, "icp");
    describe(schema, icp);
    return config;
}

/// A map that was stored coarsely is wrong by more than one of scans, and that is no weakness of a
/// direction.
TrackingConfig in_map(TrackingConfig config, const ReferenceMap& map) {
    config.translation_floor = std::hypot(config.translation_floor, map.wall_sigma());
    config.rotation_floor = std::hypot(config.rotation_floor, map.heading_sigma());
    config.weak_sigma = std::hypot(config.weak_sigma, map.wall_sigma());
    return config;
}

}  // namespace

struct MapTracker::State {
    State(std::shared_ptr<const ReferenceMap> map_in, const TrackingConfig& config_in,
          const IcpConfig& icp_in)
        : map(expect_map(std::move(map_in))),
          config(in_map(checked(config_in, icp_in), *map)),
          icp(icp_in),
          window(static_cast<std::size_t>(config.window), config.kernel_scale),
          health(config) {
        icp.kernel_scale = config.gate / 2.0;
        anchoring.gate = config.gate;
        anchoring.translation_floor = config.translation_floor;
        anchoring.rotation_floor = config.rotation_floor;
    }

    bool leapt(double now, const OdometryResult& odometry) const;
    bool is_node(double now, const Pose2d& node_from_robot) const;
    ScanAnchor look(const Surface& scan, const PoseBelief& expected) const;

    std::shared_ptr<const ReferenceMap> map;
    TrackingConfig config;
    IcpConfig icp;
    ScanAnchorConfig anchoring;
    WindowGraph window;
    TrackingHealth health;
    std::optional<OdometrySince> since_node;  ///< empty until the first scan after start
    double node_stamp = 0.0;
    double stamp = 0.0;  ///< of the scan before
    bool started = false;
};

MapTracker::MapTracker(std::shared_ptr<const ReferenceMap> map, const TrackingConfig& config,
                       const IcpConfig& icp)
    : state_(std::make_unique<State>(std::move(map), config, icp)) {}
MapTracker::~MapTracker() = default;
MapTracker::MapTracker(MapTracker&&) noexcept = default;
MapTracker& MapTracker::operator=(MapTracker&&) noexcept = default;

void MapTracker::start(const Pose2d& map_from_robot, const Eigen::Matrix3d& covariance) {
    if (!is_sound({map_from_robot, covariance})) {
        throw Error("tracking: the start pose is not finite, or its covariance is none");
    }
    State& s = *state_;
    const Eigen::Matrix3d floor = squared(s.config.translation_floor, s.config.rotation_floor);
    s.window.start({map_from_robot, covariance + floor});
    s.since_node.reset();
    s.health = TrackingHealth(s.config);
    s.started = true;
}

Track MapTracker::track(double stamp, const OdometryResult& odometry,
                        const Pose2d& robot_from_laser) {
    State& s = *state_;
    if (!s.started) {
        throw Error("tracking: the tracker was not started");
    }
    const bool leapt = s.since_node && s.leapt(stamp, odometry);
    if (!s.since_node) {
        s.since_node.emplace(odometry);
        s.node_stamp = stamp;
    }
    const MotionBelief motion = s.since_node->motion(odometry);
    const PoseBelief expected = advanced(s.window.newest(), motion);
    const ScanAnchor scan = s.look(odometry.surface, expected);

    Track track;
    track.chi2 = scan.found ? chi2(scan.anchor, with_leeway(expected)) : 0.0;
    const bool agrees = track.chi2 <= s.config.max_chi2;
    const bool shows_walls = scan.found && scan.near >= s.config.min_explained;
    track.anchored = shows_walls && agrees;
    const bool keep = s.is_node(stamp, motion.before_from_now);
    const PoseBelief belief =
        s.window.add(motion, track.anchored ? std::make_optional(scan.anchor) : std::nullopt, keep);
    s.since_node->pass(odometry, keep);
    if (keep) {
        s.node_stamp = stamp;
    }
    track.map_from_robot = belief.map_from_robot;
    // The map's own error is the same in all anchors of a place: it does not average out.
    track.covariance =
        belief.covariance + squared(s.config.translation_floor, s.config.rotation_floor);
    track.fit =
        fit_of(*s.map, {{robot_from_laser.translation, odometry.surface}}, track.map_from_robot);
    track.weak_direction = weakest_direction(track.covariance);
    track.status = s.health.judge(stamp, track, {shows_walls && !agrees, leapt});
    s.stamp = stamp;
    return track;
}

bool MapTracker::State::is_node(double now, const Pose2d& node_from_robot) const {
    return node_from_robot.translation.norm() >= config.node_distance ||
           std::abs(node_from_robot.heading) >= config.node_angle ||
           now - node_stamp >= config.node_seconds;
}

bool MapTracker::State::leapt(double now, const OdometryResult& odometry) const {
    constexpr double kSpeed = 5.0;      // m/s
    constexpr double kTurnRate = 4.0;   // rad/s
    constexpr double kShortest = 0.05;  // s, as stamps jitter
    const double passed = std::max(kShortest, now - stamp);
    return odometry.before_from_now.translation.norm() > kSpeed * passed ||
           std::abs(odometry.before_from_now.heading) > kTurnRate * passed;
}

/// What a lost robot sees is no witness.
ScanAnchor MapTracker::State::look(const Surface& scan, const PoseBelief& expected) const {
    return health.lost() ? ScanAnchor() : anchor_of(*map, scan, expected, anchoring, icp);
}

std::string_view to_string(TrackingStatus status) {
    switch (status) {
        case TrackingStatus::kTracking:
            return "tracking";
        case TrackingStatus::kDegraded:
            return "degraded";
        case TrackingStatus::kLost:
            return "lost";
    }
    return "unknown";
}

void describe(ConfigSchema& schema, TrackingConfig& config) {
    schema.add("window", config.window, 1, 1000, "nodes kept in the sliding window");
    schema.add("node_distance", config.node_distance, 0.01, 100.0, "m, between two of them, or");
    schema.add_degrees("node_angle_deg", config.node_angle, 0.5, 180.0, "or");
    schema.add("node_seconds", config.node_seconds, 0.01, 1e6, "s");
    schema.add("gate", config.gate, 0.01, 0.25,
               "m, points farther from the map's walls are left out, besides the pose's own doubt");
    schema.add("min_explained", config.min_explained, 0.0, 1.0,
               "share of the points near walls below which a scan anchors nothing");
    schema.add("kernel_scale", config.kernel_scale, 0.01, 100.0, "sigmas, of the anchors");
    schema.add("translation_floor", config.translation_floor, 1e-4, 1.0,
               "m, by which the map itself may be wrong");
    schema.add_degrees("rotation_floor_deg", config.rotation_floor, 5e-4, 50.0, "likewise");
    schema.add("weak_sigma", config.weak_sigma, 1e-3, 100.0,
               "m, less sure than this in a direction is degraded");
    schema.add("lost_after", config.lost_after, 0.0, 60.0,
               "s of disagreement with the map until lost");
    schema.add("max_chi2", config.max_chi2, 0.1, 1e9,
               "of an anchor against the window, beyond which it disagrees");
}

}  // namespace hybrid_slam
