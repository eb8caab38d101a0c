// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/odometry/visual_track.hpp"

#include <algorithm>

#include "hybrid_slam/core/uncertainty.hpp"

namespace hybrid_slam {
namespace {

constexpr double kTwistWindow = 0.1;  ///< seconds of images that tell the speed
/// Of what a vehicle may do while nobody looks.
constexpr double kAcceleration = 0.5;         ///< m/s2
constexpr double kAngularAcceleration = 1.0;  ///< rad/s2

void append(VisualTrack::Motion& motion, const Pose2d& step, const Eigen::Matrix3d& covariance) {
    const Eigen::Matrix2d rotation = motion.from_from_to.rotation();
    motion.covariance =
        swung(motion.covariance, rotation * step.translation) + turned(covariance, rotation);
    motion.from_from_to = motion.from_from_to * step;
}

/// Of a motion whose speed has changed by nobody knows what.
Eigen::Matrix3d drift(double seconds) {
    const double metres = 0.5 * kAcceleration * seconds * seconds;
    const double angle = 0.5 * kAngularAcceleration * seconds * seconds;
    return Eigen::Vector3d(metres * metres, metres * metres, angle * angle).asDiagonal();
}

}  // namespace

void VisualTrack::add(const VisualMotion& motion) {
    motions_.push_back(motion);
    newest_ = motion.stamp;
}

void VisualTrack::forget_before(double stamp) {
    // What tells the speed at the stamp is kept too.
    while (!motions_.empty() && motions_.front().stamp < stamp - kTwistWindow) {
        motions_.pop_front();
    }
}

std::optional<VisualTrack::Motion> VisualTrack::within(double from, double to) const {
    Motion motion;
    double reached = from;
    for (const VisualMotion& step : motions_) {
        if (step.stamp <= reached || step.from_stamp >= to) {
            continue;
        }
        if (step.from_stamp > reached || !step.usable()) {
            return std::nullopt;
        }
        const double until = std::min(step.stamp, to);
        const double share = (until - reached) / (step.stamp - step.from_stamp);
        append(motion, Pose2d::exp(share * step.before_from_now.log()), share * step.covariance);
        reached = until;
    }
    return reached >= to ? std::optional<Motion>(motion) : std::nullopt;
}

std::optional<VisualTrack::Motion> VisualTrack::between(double from, double to,
                                                        double most_extrapolation) const {
    if (motions_.empty() || !(from < to) || !motions_.back().usable()) {
        return std::nullopt;
    }
    const double seen = std::min(to, motions_.back().stamp);
    const double beyond = to - seen;
    if (beyond > most_extrapolation) {
        return std::nullopt;
    }
    std::optional<Motion> motion =
        seen > from ? within(from, seen) : std::optional<Motion>(Motion());
    if (!motion) {
        return std::nullopt;
    }
    // The speed around the end, from images to both sides of it where there are.
    const double last = std::min(seen + 0.5 * kTwistWindow, motions_.back().stamp);
    double first = std::max(last - kTwistWindow, motions_.front().from_stamp);
    std::optional<Motion> recent = within(first, last);
    if (!recent) {
        first = motions_.back().from_stamp;
        recent = within(first, motions_.back().stamp);
        motion->twist = recent->from_from_to.log() / (motions_.back().stamp - first);
    } else {
        motion->twist = recent->from_from_to.log() / (last - first);
    }
    if (beyond > 0.0) {
        const double start = std::max(seen, from);
        append(*motion, Pose2d::exp((to - start) * motion->twist), drift(beyond));
        motion->extrapolated = beyond;
    }
    return motion;
}

}  // namespace hybrid_slam
