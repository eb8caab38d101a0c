// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/odometry/odometry.hpp"

#include <Eigen/LU>
#include <cmath>
#include <utility>

#include "hybrid_slam/core/uncertainty.hpp"

namespace hybrid_slam {

namespace {

// Sigmas of an alignment that explains too little of the scan, and of a motion of which nothing is
// known.
constexpr double kDoubtfulTranslation = 0.1;        // metres
constexpr double kDoubtfulRotation = radians(3.0);  // radians
constexpr double kUnknownTranslation = 0.5;         // metres
constexpr double kUnknownRotation = 0.5;            // radians

Eigen::Matrix3d diagonal(double translation, double rotation) {
    return Eigen::Vector3d(translation * translation, translation * translation,
                           rotation * rotation)
        .asDiagonal();
}

// Which of two alignments explains the scan better: overlap first, where it differs visibly.
bool better(const IcpResult& a, const IcpResult& b) {
    if (!a.usable() || !b.usable()) {
        return a.usable();
    }
    return a.overlap > b.overlap + 0.02 || (a.overlap > b.overlap - 0.02 && a.rms < b.rms);
}

}  // namespace

std::string_view to_string(OdometryStatus status) {
    switch (status) {
        case OdometryStatus::kFirst:
            return "first";
        case OdometryStatus::kAligned:
            return "aligned";
        case OdometryStatus::kPriorOnly:
            return "prior_only";
    }
    return "unknown";
}

Odometry::Odometry(const OdometryConfig& config)
    : config_(config),
      predictor_(config.prior),
      local_map_(config.reference == ReferenceKind::kPreviousScan
                     ? LocalMapConfig{1, config.local_map.resolution}
                     : config.local_map) {}

OdometryResult Odometry::register_frame(const Frame& frame) {
    const MotionPrior prior = predictor_.predict(frame);
    const double elapsed = stamp_ ? frame.scan.stamp - *stamp_ : 0.0;
    const Eigen::Vector3d twist = elapsed > 1e-3
                                      ? Eigen::Vector3d(prior.before_from_now.log() / elapsed)
                                      : Eigen::Vector3d::Zero();
    OdometryResult result;
    result.surface = to_surface(frame.scan, config_.filter, twist);
    if (local_from_robot_) {
        locate(frame, prior, result);
    }
    // What saw nothing is no place to come back to; the edge across it grows uncertain instead.
    result.keyframe =
        !local_from_robot_ || (result.surface.size() > 0 && is_keyframe(result.local_from_robot));
    if (result.keyframe || !local_map_.reference() ||
        config_.reference == ReferenceKind::kPreviousScan) {
        const bool all = config_.icp.metric == IcpMetric::kPointToPoint;
        local_map_.insert(
            transform(result.local_from_robot, all ? result.surface : oriented(result.surface)));
    }
    if (result.keyframe) {
        local_from_keyframe_ = result.local_from_robot;
    }
    predictor_.update(frame, result.before_from_now);
    local_from_robot_ = result.local_from_robot;
    covariance_ = result.keyframe ? Eigen::Matrix3d::Zero() : result.covariance;
    stamp_ = frame.scan.stamp;
    return result;
}

void Odometry::locate(const Frame& frame, MotionPrior prior, OdometryResult& result) const {
    if (local_map_.reference()) {
        result.icp = align_from(result.surface, prior);
        if (is_doubtful(result.icp, prior)) {
            // The prior may lie: some odometry never goes backwards or lags, wheels slip, robots
            // are pushed. But what explains little itself, as when somebody stands before the
            // scanner, is no witness against it.
            for (const MotionPrior& other : predictor_.alternatives(frame)) {
                IcpResult icp = align_from(result.surface, other);
                if (icp.overlap >= config_.doubtful_overlap && better(icp, result.icp)) {
                    result.icp = icp;
                    prior = other;
                }
            }
        }
    }
    result.prior_used = prior.used;
    if (result.icp.usable()) {
        result.status = OdometryStatus::kAligned;
        result.local_from_robot = result.icp.reference_from_points;
    } else {
        result.status = OdometryStatus::kPriorOnly;
        result.local_from_robot = *local_from_robot_ * prior.before_from_now;
    }
    result.before_from_now = between(*local_from_robot_, result.local_from_robot);
    result.covariance =
        covariance_of(result, turned(prior.information, local_from_robot_->rotation()));
}

Eigen::Matrix3d Odometry::covariance_of(const OdometryResult& result,
                                        const Eigen::Matrix3d& prior_information) const {
    const Eigen::Matrix3d before =
        swung(covariance_, result.local_from_robot.translation - local_from_robot_->translation);
    const Eigen::Matrix3d step = prior_information.isZero(0.0)
                                     ? diagonal(kUnknownTranslation, kUnknownRotation)
                                     : Eigen::Matrix3d(prior_information.inverse());
    if (!result.icp.usable()) {
        return before + step;
    }
    const Eigen::Matrix3d doubt = result.icp.overlap < config_.doubtful_overlap
                                      ? diagonal(kDoubtfulTranslation, kDoubtfulRotation)
                                      : Eigen::Matrix3d::Zero();
    // The closed form of point to point never looks at the prior.
    const bool weighed = config_.icp.metric == IcpMetric::kPointToLine;
    const auto posterior = [&](const Eigen::Matrix3d& prior) -> Eigen::Matrix3d {
        const Eigen::Matrix3d information =
            weighed ? Eigen::Matrix3d(result.icp.information + prior.inverse())
                    : result.icp.information;
        return information.inverse() + doubt;
    };
    // A local map holds the last keyframe: what ICP says is against that. Scan to scan, errors add
    // up.
    return config_.reference == ReferenceKind::kLocalMap ? posterior(before + step)
                                                         : before + posterior(step);
}

IcpResult Odometry::align_from(const Surface& surface, const MotionPrior& prior) const {
    const IcpGuess guess{*local_from_robot_ * prior.before_from_now,
                         turned(prior.information, local_from_robot_->rotation())};
    return align(surface, *local_map_.reference(), guess, config_.icp);
}

bool Odometry::is_doubtful(const IcpResult& icp, const MotionPrior& prior) const {
    if (!icp.usable() || icp.overlap < config_.doubtful_overlap) {
        return true;
    }
    const Pose2d found = between(*local_from_robot_, icp.reference_from_points);
    const Eigen::Vector3d error = difference(found, prior.before_from_now);
    return error.dot(prior.information * error) > config_.doubtful_chi2;
}

bool Odometry::is_keyframe(const Pose2d& local_from_robot) const {
    const Pose2d moved = between(local_from_keyframe_, local_from_robot);
    return moved.translation.norm() >= config_.keyframe.distance ||
           std::abs(moved.heading) >= config_.keyframe.angle;
}

void describe(ConfigSchema& schema, OdometryConfig& config) {
    {
        const ConfigSchema::Section section(schema, "odometry");
        schema.add("reference", config.reference,
                   {{"previous_scan", ReferenceKind::kPreviousScan},
                    {"local_map", ReferenceKind::kLocalMap}},
                   "what a scan is aligned to");
        schema.add("doubtful_chi2", config.doubtful_chi2, 0.1, 1e9,
                   "disagreement with the prior beyond which other starts are tried");
        schema.add("prior", config.prior.kind,
                   {{"none", PriorKind::kNone},
                    {"constant_velocity", PriorKind::kConstantVelocity},
                    {"wheel", PriorKind::kWheel}},
                   "where the first guess of a motion comes from");
        schema.add("doubtful_overlap", config.doubtful_overlap, 0.0, 1.0,
                   "share of matched points below which other starts are tried");
    }
    {
        const ConfigSchema::Section section(schema, "prior");
        describe(schema, config.prior);
    }
    {
        const ConfigSchema::Section section(schema, "scan");
        describe(schema, config.filter);
    }
    {
        const ConfigSchema::Section section(schema, "icp");
        describe(schema, config.icp);
    }
    {
        const ConfigSchema::Section section(schema, "local_map");
        describe(schema, config.local_map);
    }
    const ConfigSchema::Section section(schema, "keyframe");
    schema.add("distance", config.keyframe.distance, 0.01, 100.0, "m, since the last keyframe");
    schema.add("angle", config.keyframe.angle, 0.01, kPi, "rad, since the last keyframe");
}

}  // namespace hybrid_slam
