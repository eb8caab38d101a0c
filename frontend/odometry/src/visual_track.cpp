// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/odometry/visual_track.hpp"

#include <algorithm>

#include "hybrid_slam/core/frame.hpp"
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
    if (motions_.size() > FrameAssembler::kMostVisual) {
        motions_.pop_front();
    }
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

/// By the images around a stamp, to both sides of it where there are.
std::optional<VisualTrack::Motion> VisualTrack::speed_at(double stamp) const {
    for (const double ahead : {0.5 * kTwistWindow, 0.0}) {
        const double last = std::min(stamp + ahead, motions_.back().stamp);
        const double first = std::max(last - kTwistWindow, motions_.front().from_stamp);
        std::optional<Motion> recent = first < last ? within(first, last) : std::optional<Motion>();
        if (recent) {
            recent->twist = recent->from_from_to.log() / (last - first);
            recent->covariance /= (last - first) * (last - first);
            return recent;
        }
    }
    // There was no image for so long before: by the one step that holds the stamp.
    for (const VisualMotion& step : motions_) {
        if (step.usable() && step.from_stamp < stamp && stamp <= step.stamp) {
            const double seconds = step.stamp - step.from_stamp;
            Motion motion;
            motion.twist = step.before_from_now.log() / seconds;
            motion.covariance = step.covariance / (seconds * seconds);
            return motion;
        }
    }
    return std::nullopt;
}

std::optional<VisualTrack::Motion> VisualTrack::between(double from, double to,
                                                        double most_extrapolation) const {
    if (motions_.empty() || !(from < to)) {
        return std::nullopt;
    }
    const double seen = std::min(to, motions_.back().stamp);
    const double beyond = to - std::max(seen, from);
    if (to - seen > most_extrapolation) {
        return std::nullopt;
    }
    std::optional<Motion> motion =
        seen > from ? within(from, seen) : std::optional<Motion>(Motion());
    const std::optional<Motion> speed = speed_at(seen);
    if (!motion || !speed) {
        return std::nullopt;
    }
    motion->twist = speed->twist;
    if (to > seen) {
        // The speed was doubtful already, and may have changed since the newest image.
        append(*motion, Pose2d::exp(beyond * speed->twist),
               beyond * beyond * speed->covariance + drift(to - seen));
    }
    return motion;
}

}  // namespace hybrid_slam
