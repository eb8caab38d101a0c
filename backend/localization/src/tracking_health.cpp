// SPDX-License-Identifier: Apache-2.0
#include "tracking_health.hpp"

#include <algorithm>

namespace hybrid_slam {
namespace {

constexpr double kAgreementCounts = 2.0;  ///< times as much as contradiction
constexpr double kMemory = 0.3;           ///< share of the newest scan in what is usual
constexpr double kViolatedAtLeast = 0.05;
constexpr double kViolatedWeight = 0.6;  ///< against what is explained
constexpr double kFall = 0.12;           ///< of the score, and
constexpr double kRise = 0.03;           ///< of the violations, from one scan to the next

}  // namespace

TrackingStatus TrackingHealth::judge(double stamp, const Track& track,
                                     const Disagreement& disagreement) {
    const double passed = stamp_ ? std::max(0.0, stamp - *stamp_) : 0.0;
    if (!stamp_ || track.anchored) {
        last_anchor_ = stamp;
    }
    stamp_ = stamp;
    const bool contradicted = contradicts(track.fit) || disagreement.refused;
    doubt_ = contradicted ? doubt_ + passed : std::max(0.0, doubt_ - kAgreementCounts * passed);
    lost_ = lost_ || disagreement.leapt || (contradicted && doubt_ >= config_.lost_after);
    if (lost_) {
        return TrackingStatus::kLost;
    }
    const double weakest =
        track.weak_direction.dot(track.covariance.topLeftCorner<2, 2>() * track.weak_direction);
    const bool weak = weakest > config_.weak_sigma * config_.weak_sigma;
    return weak || stamp - last_anchor_ > config_.lost_after ? TrackingStatus::kDegraded
                                                             : TrackingStatus::kTracking;
}

/// Things that are new before the walls only hide them. A beam through a wall speaks against the
/// pose, unless the wall is gone: so either violations outweigh what is explained, or they come all
/// at once, as when the robot is elsewhere all at once. A changed hall comes into view bit by bit.
bool TrackingHealth::contradicts(const ScanFit& fit) {
    if (fit.points == 0) {
        return false;
    }
    const bool sudden = fell_suddenly({fit.explained - fit.violated, fit.violated});
    return sudden ||
           (fit.violated > kViolatedAtLeast && kViolatedWeight * fit.violated > fit.explained);
}

bool TrackingHealth::fell_suddenly(const Level& now) {
    if (!usual_) {
        usual_ = now;
    }
    const double fall = usual_->score - now.score;
    if (!fallen_ && fall > kFall && now.violated - usual_->violated > kRise) {
        fallen_ = now.score + 0.5 * fall;
    }
    if (fallen_ && now.score < *fallen_) {
        return true;
    }
    fallen_.reset();
    usual_->score += kMemory * (now.score - usual_->score);
    usual_->violated += kMemory * (now.violated - usual_->violated);
    return false;
}

}  // namespace hybrid_slam
