// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <deque>
#include <optional>

#include "hybrid_slam/localization/scan_fit.hpp"
#include "hybrid_slam/odometry/odometry.hpp"

namespace hybrid_slam {

/// How far apart the scans of a query are, and how far back they reach.
struct SweepSpacing {
    double path = 10.0;     ///< metres driven
    double distance = 0.3;  ///< metres between two, or
    double angle = radians(15.0);
};

/// What was seen on the way of late, tied by odometry, to search a place by.
class SweepHistory {
  public:
    explicit SweepHistory(const SweepSpacing& spacing) : spacing_(spacing) {}

    /// Each scan in order. What came before is forgotten where nobody knows the motion since.
    void add(const OdometryResult& odometry, const Point2& origin);
    /// The newest scan first; those not farther back than `path` metres.
    Query query(double path) const;
    /// Keeps what is not farther back than `path` metres.
    void forget_beyond(double path);
    void clear();

    /// Metres driven and radians turned (to both sides) so far, between stands that are apart: the
    /// noise of scans is no way, however long it stands.
    double path() const { return path_ + since_stand().translation.norm(); }
    double turn() const { return turn_ + std::abs(since_stand().heading); }
    const Sweep& newest() const { return newest_->sweep; }

  private:
    struct Entry {
        Pose2d local_from_robot;
        double path = 0.0;
        Sweep sweep;
    };

    bool is_far(const Pose2d& motion) const;
    Pose2d since_stand() const;
    void leave_stand();

    SweepSpacing spacing_;
    std::deque<Entry> kept_;  ///< the newest one first; without newest_
    std::optional<Entry> newest_;
    std::optional<Pose2d> local_from_stand_;  ///< up to which path_ and turn_ count
    double path_ = 0.0;
    double turn_ = 0.0;
};

}  // namespace hybrid_slam
