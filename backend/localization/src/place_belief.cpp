// SPDX-License-Identifier: Apache-2.0
#include "place_belief.hpp"

#include <cmath>

namespace hybrid_slam {
namespace {

// Scans from one spot err alike: a standing robot learns nothing from seeing the same again.
constexpr double kNewView = 0.1;                // metres, or
constexpr double kNewViewAngle = radians(5.0);  // radians
constexpr double kDecidedShare = 0.99;
constexpr double kDecidedWay = 1.5;       // metres
constexpr double kHopelessQuality = 0.3;  // likelihood of the best particles' beams

}  // namespace

void PlaceBelief::start(const std::vector<Place>& places, const OdometryResult& odometry,
                        double path) {
    filter_.start(places);
    since_weighed_.emplace(odometry);
    weighed_from_now_ = Pose2d();
    weighed_ = false;
    decided_since_ = path;
}

void PlaceBelief::stop() {
    since_weighed_.reset();
}

void PlaceBelief::follow(const OdometryResult& odometry, const Sweep& sweep, double path) {
    if (!is_running()) {
        return;
    }
    const MotionBelief motion = since_weighed_->motion(odometry);
    weighed_from_now_ = motion.before_from_now;
    const bool moved = weighed_from_now_.translation.norm() >= kNewView ||
                       std::abs(weighed_from_now_.heading) >= kNewViewAngle;
    since_weighed_->pass(odometry, moved);
    if (!moved) {
        return;
    }
    filter_.move(motion.before_from_now, motion.covariance);
    filter_.weigh(sweep);
    weighed_from_now_ = Pose2d();
    weighed_ = true;
    if (filter_.places().front().share <= kDecidedShare) {
        decided_since_ = path;
    }
}

std::vector<Place> PlaceBelief::places() const {
    std::vector<Place> places;
    if (is_running()) {
        places = filter_.places();
    }
    for (Place& place : places) {
        place.map_from_robot = place.map_from_robot * weighed_from_now_;
    }
    return places;
}

bool PlaceBelief::is_decided(double path) const {
    return is_running() && path - decided_since_ >= kDecidedWay;
}

bool PlaceBelief::is_hopeless() const {
    return is_running() && weighed_ && filter_.quality() < kHopelessQuality;
}

}  // namespace hybrid_slam
