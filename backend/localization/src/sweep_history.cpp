// SPDX-License-Identifier: Apache-2.0
#include "sweep_history.hpp"

#include <cmath>
#include <utility>

namespace hybrid_slam {
namespace {

constexpr std::size_t kMost = 100;  // while turning on the spot no path is driven

/// The scan could not be aligned, and nothing has seen the motion.
bool is_guesswork(const OdometryResult& odometry) {
    return odometry.status == OdometryStatus::kPriorOnly &&
           (odometry.prior_used == PriorKind::kNone ||
            odometry.prior_used == PriorKind::kConstantVelocity);
}

}  // namespace

void SweepHistory::add(const OdometryResult& odometry, const Point2& origin) {
    if (is_guesswork(odometry) && odometry.surface.size() > 0) {
        clear();
    }
    path_ += odometry.before_from_now.translation.norm();
    turn_ += std::abs(odometry.before_from_now.heading);
    if (newest_ && is_far_from_last()) {
        kept_.push_front(std::move(*newest_));
    }
    newest_ = Entry{odometry.local_from_robot, path_, {origin, odometry.surface}};
    forget_beyond(spacing_.path);
}

bool SweepHistory::is_far_from_last() const {
    if (newest_->sweep.surface.size() == 0) {
        return false;
    }
    if (kept_.empty()) {
        return true;
    }
    const Pose2d apart = between(kept_.front().local_from_robot, newest_->local_from_robot);
    return apart.translation.norm() >= spacing_.distance ||
           std::abs(apart.heading) >= spacing_.angle;
}

Query SweepHistory::query(double path) const {
    Query query;
    if (!newest_) {
        return query;
    }
    query.push_back(newest_->sweep);
    const Pose2d robot_from_local = newest_->local_from_robot.inverse();
    for (const Entry& entry : kept_) {
        const Pose2d robot_from_entry = robot_from_local * entry.local_from_robot;
        const bool far = robot_from_entry.translation.norm() >= 0.5 * spacing_.distance ||
                         std::abs(robot_from_entry.heading) >= 0.5 * spacing_.angle;
        if (far && path_ - entry.path <= path) {
            query.push_back(transform(robot_from_entry, entry.sweep));
        }
    }
    return query;
}

void SweepHistory::forget_beyond(double path) {
    while (!kept_.empty() && (path_ - kept_.back().path > path || kept_.size() > kMost)) {
        kept_.pop_back();
    }
}

void SweepHistory::clear() {
    kept_.clear();
    newest_.reset();
}

}  // namespace hybrid_slam
