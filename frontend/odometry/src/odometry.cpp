// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/odometry/odometry.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
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
constexpr double kDoubtMemory = 0.1;      // share of the newest scan in the doubt about vision
constexpr double kMostDoubt = 1000.0;     // by a single scan
constexpr double kUnknownRotation = 0.5;  // radians

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
        case OdometryStatus::kDeadReckoned:
            return "dead_reckoned";
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
    const MotionPrior claimed = predictor_.predict(frame);
    const MotionPrior prior = doubted(claimed);
    OdometryResult result;
    result.visual_lag = predictor_.visual_lag(frame);
    result.surface = to_surface(frame.scan, config_.filter, prior.twist);
    if (local_from_robot_) {
        locate(frame, prior, result);
    }
    // What saw nothing is no place to come back to; the edge across it grows uncertain instead.
    result.keyframe =
        !local_from_robot_ || (result.surface.size() > 0 && is_keyframe(result.local_from_robot));
    if (config_.reference != ReferenceKind::kNone &&
        (result.keyframe || !local_map_.reference() ||
         config_.reference == ReferenceKind::kPreviousScan)) {
        const bool all = config_.icp.metric == IcpMetric::kPointToPoint;
        local_map_.insert(
            transform(result.local_from_robot, all ? result.surface : oriented(result.surface)));
    }
    if (result.keyframe) {
        local_from_keyframe_ = result.local_from_robot;
    }
    if (claimed.used == PriorKind::kVisual && result.icp.usable()) {
        visual_doubt_ += kDoubtMemory * (contradiction(claimed, result.icp) - visual_doubt_);
    }
    result.visual_doubt = visual_doubt_;
    predictor_.update(frame, result.before_from_now);
    local_from_robot_ = result.local_from_robot;
    covariance_ = result.keyframe ? Eigen::Matrix3d::Zero() : result.covariance;
    return result;
}

void Odometry::locate(const Frame& frame, MotionPrior prior, OdometryResult& result) const {
    if (local_map_.reference()) {
        result.icp = align_from(result.surface, prior);
        if (is_doubtful(result.icp, prior)) {
            // The prior may lie: some odometry never goes backwards or lags, wheels slip, robots
            // are pushed. But what explains little itself, as when somebody stands before the
            // scanner, is no witness against it.
            for (const MotionPrior& other : predictor_.alternatives(frame, prior)) {
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
        result.status = config_.reference == ReferenceKind::kNone ? OdometryStatus::kDeadReckoned
                                                                  : OdometryStatus::kPriorOnly;
        result.local_from_robot = *local_from_robot_ * prior.before_from_now;
    }
    result.before_from_now = between(*local_from_robot_, result.local_from_robot);
    result.covariance = covariance_of(result, prior);
}

/// Of where the prior puts the robot, in the axes of local: against the last keyframe, which a
/// local map holds; against the place before, where scans are aligned one to the next.
Eigen::Matrix3d Odometry::prior_covariance(const MotionPrior& prior,
                                           const Pose2d& local_from_robot) const {
    const Eigen::Matrix3d step =
        prior.information.isZero(0.0)
            ? diagonal(kUnknownTranslation, kUnknownRotation)
            : turned(prior.information.inverse(), local_from_robot_->rotation());
    return config_.reference == ReferenceKind::kLocalMap
               ? covariance_carried_to(local_from_robot) + step
               : step;
}

Eigen::Matrix3d Odometry::covariance_carried_to(const Pose2d& local_from_robot) const {
    return swung(covariance_, local_from_robot.translation - local_from_robot_->translation);
}

Eigen::Matrix3d Odometry::covariance_of(const OdometryResult& result,
                                        const MotionPrior& prior) const {
    // Scan to scan, errors add up.
    const Eigen::Matrix3d before = config_.reference == ReferenceKind::kLocalMap
                                       ? Eigen::Matrix3d::Zero()
                                       : covariance_carried_to(result.local_from_robot);
    const Eigen::Matrix3d by_prior = prior_covariance(prior, result.local_from_robot);
    if (!result.icp.usable()) {
        return before + by_prior;
    }
    const Eigen::Matrix3d doubt = result.icp.overlap < config_.doubtful_overlap
                                      ? diagonal(kDoubtfulTranslation, kDoubtfulRotation)
                                      : Eigen::Matrix3d::Zero();
    // The closed form of point to point never looks at the prior.
    const Eigen::Matrix3d information =
        config_.icp.metric == IcpMetric::kPointToLine
            ? Eigen::Matrix3d(result.icp.information + by_prior.inverse())
            : result.icp.information;
    return before + information.inverse() + doubt;
}

/// What has been wrong lately is believed less.
MotionPrior Odometry::doubted(MotionPrior prior) const {
    if (prior.used == PriorKind::kVisual && visual_doubt_ > 1.0) {
        prior.information /= visual_doubt_;
    }
    return prior;
}

/// chi2 for each degree of freedom of the difference between where the scan alone and the prior
/// alone put the robot.
double Odometry::contradiction(const MotionPrior& prior, const IcpResult& icp) const {
    const IcpGuess guess = guess_from(prior);
    const IcpGuess used = guess_from(doubted(prior));
    const Eigen::LLT<Eigen::Matrix3d> scan(icp.information);
    if (config_.icp.metric != IcpMetric::kPointToLine || scan.info() != Eigen::Success) {
        return 0.0;
    }
    // The result is between the two: the scan's own optimum lies as far beyond as the prior pulled.
    const Eigen::Vector3d moved =
        difference(icp.reference_from_points, guess.reference_from_points);
    const Eigen::Vector3d apart = moved + scan.solve(used.information * moved);
    const Eigen::Matrix3d covariance =
        guess.information.inverse() + scan.solve(Eigen::Matrix3d::Identity());
    return std::min(apart.dot(covariance.inverse() * apart) / 3.0, kMostDoubt);
}

IcpResult Odometry::align_from(const Surface& surface, const MotionPrior& prior) const {
    return align(surface, *local_map_.reference(), guess_from(prior), config_.icp);
}

/// What is known before looking at the scan: the place before and the motion since, each with its
/// doubt.
IcpGuess Odometry::guess_from(const MotionPrior& prior) const {
    IcpGuess guess(*local_from_robot_ * prior.before_from_now);
    if (!prior.information.isZero(0.0)) {
        guess.information = prior_covariance(prior, guess.reference_from_points).inverse();
    }
    return guess;
}

bool Odometry::is_doubtful(const IcpResult& icp, const MotionPrior& prior) const {
    if (!icp.usable() || icp.overlap < config_.doubtful_overlap) {
        return true;
    }
    const IcpGuess guess = guess_from(prior);
    const Eigen::Vector3d error =
        difference(icp.reference_from_points, guess.reference_from_points);
    return error.dot(guess.information * error) > config_.doubtful_chi2;
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
                   {{"none", ReferenceKind::kNone},
                    {"previous_scan", ReferenceKind::kPreviousScan},
                    {"local_map", ReferenceKind::kLocalMap}},
                   "what a scan is aligned to; none: the prior alone moves the robot");
        schema.add("doubtful_chi2", config.doubtful_chi2, 0.1, 1e9,
                   "disagreement with the prior beyond which other starts are tried");
        schema.add("prior", config.prior.kind,
                   {{"none", PriorKind::kNone},
                    {"constant_velocity", PriorKind::kConstantVelocity},
                    {"wheel", PriorKind::kWheel},
                    {"visual", PriorKind::kVisual}},
                   "where the first guess of a motion comes from; visual falls back to wheel, "
                   "wheel to constant_velocity");
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
