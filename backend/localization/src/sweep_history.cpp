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
    if (newest_ && newest_->sweep.surface.size() > 0 &&
        (kept_.empty() ||
         is_far(between(kept_.front().local_from_robot, newest_->local_from_robot)))) {
        kept_.push_front(std::move(*newest_));
    }
    newest_ = Entry{odometry.local_from_robot, 0.0, {origin, odometry.surface}};
    if (!local_from_stand_ || is_far(since_stand())) {
        leave_stand();
    }
    newest_->path = path();
    forget_beyond(spacing_.path);
}

bool SweepHistory::is_far(const Pose2d& motion) const {
    return motion.translation.norm() >= spacing_.distance ||
           std::abs(motion.heading) >= spacing_.angle;
}

Pose2d SweepHistory::since_stand() const {
    return newest_ && local_from_stand_ ? between(*local_from_stand_, newest_->local_from_robot)
                                        : Pose2d();
}

void SweepHistory::leave_stand() {
    const Pose2d motion = since_stand();
    path_ += motion.translation.norm();
    turn_ += std::abs(motion.heading);
    local_from_stand_ = newest_->local_from_robot;
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
        if (far && newest_->path - entry.path <= path) {
            query.push_back(transform(robot_from_entry, entry.sweep));
        }
    }
    return query;
}

void SweepHistory::forget_beyond(double path) {
    while (!kept_.empty() && (newest_->path - kept_.back().path > path || kept_.size() > kMost)) {
        kept_.pop_back();
    }
}

void SweepHistory::clear() {
    if (newest_) {
        leave_stand();
    }
    kept_.clear();
    newest_.reset();
    local_from_stand_.reset();
}

}  // namespace hybrid_slam
