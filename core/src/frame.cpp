// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/frame.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hybrid_slam {
namespace {

/// Two readings that came in one burst say little about the speed; do not stretch them further.
constexpr double kMaxStretch = 10.0;

}  // namespace

std::optional<Frame> FrameAssembler::push(Measurement measurement) {
    if (const auto* odometry = std::get_if<WheelOdometry>(&measurement)) {
        // A repeated stamp replaces its reading, so that the two stay good for a speed.
        if (!newest_ || newest_->stamp != odometry->stamp) {
            before_newest_ = newest_;
        }
        newest_ = *odometry;
        return std::nullopt;
    }
    if (const auto* motion = std::get_if<VisualMotion>(&measurement)) {
        visual_.push_back(*motion);
        if (visual_.size() > kMostVisual) {
            visual_.pop_front();
        }
        newest_visual_ = motion->stamp;
        const bool done = waiting_ && motion->stamp >= waiting_->scan.stamp;
        return done ? complete() : std::nullopt;
    }
    if (!std::holds_alternative<Scan>(measurement)) {
        return std::nullopt;
    }
    std::optional<Frame> before = complete();
    Frame frame;
    frame.scan = std::get<Scan>(std::move(measurement));
    frame.odom_from_robot = odometry_at(frame.scan.stamp);
    waiting_ = std::move(frame);
    // One frame at a time goes out: one that could go at once waits for the next push.
    return before || waits() ? std::move(before) : complete();
}

bool FrameAssembler::waits() const {
    const double late = newest_visual_ ? waiting_->scan.stamp - *newest_visual_ : 0.0;
    return late > 0.0 && late <= visual_wait_;
}

std::optional<Frame> FrameAssembler::complete() {
    std::optional<Frame> frame = std::move(waiting_);
    waiting_.reset();
    if (frame) {
        frame->visual.assign(visual_.begin(), visual_.end());
        visual_.clear();
    }
    return frame;
}

std::optional<Frame> FrameAssembler::flush() {
    return complete();
}

std::optional<Pose2d> FrameAssembler::odometry_at(double stamp) const {
    for (const auto& reading : {newest_, before_newest_}) {
        if (reading && reading->stamp == stamp) {
            return reading->odom_from_robot;
        }
    }
    if (!newest_ || !before_newest_) {
        return std::nullopt;
    }
    const double interval = newest_->stamp - before_newest_->stamp;
    const double since_before = stamp - before_newest_->stamp;
    const double since_newest = stamp - newest_->stamp;
    const double away = std::min(std::abs(since_before), std::abs(since_newest));
    // Put so that a clock that ran backwards between the two, and NaN, give nothing.
    if (!(interval > 0.0 && away <= std::min(kMaxExtrapolation, kMaxStretch * interval))) {
        return std::nullopt;
    }
    return interpolate(before_newest_->odom_from_robot, newest_->odom_from_robot,
                       since_before / interval);
}

}  // namespace hybrid_slam
