// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "hybrid_slam/localization/particle_filter.hpp"
#include "odometry_since.hpp"

namespace hybrid_slam {

/// The particle filter while several places are possible: fed so that evidence is counted once.
class PlaceBelief {
  public:
    PlaceBelief(std::shared_ptr<const ReferenceMap> map, const ParticleFilterConfig& config)
        : filter_(std::move(map), config) {}

    /// The robot is at one of these places at this scan. `path`: metres driven so far.
    void start(const std::vector<Place>& places, const OdometryResult& odometry, double path);
    void stop();
    bool is_running() const { return since_weighed_.has_value(); }

    /// The next scan.
    void follow(const OdometryResult& odometry, const Sweep& sweep, double path);

    /// The clusters at the newest scan, the heaviest first; none while it rests.
    std::vector<Place> places() const;
    std::size_t size() const { return is_running() ? filter_.size() : 0; }

    /// One place has had nearly all of the belief for some metres.
    bool is_decided(double path) const;
    /// None of the particles explains what is seen.
    bool is_hopeless() const;

  private:
    ParticleFilter filter_;
    std::optional<OdometrySince> since_weighed_;
    Pose2d weighed_from_now_;
    bool weighed_ = false;        ///< at least once since the start
    double decided_since_ = 0.0;  ///< path
};

}  // namespace hybrid_slam
