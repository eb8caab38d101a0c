// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "hybrid_slam/localization/particle_filter.hpp"

namespace hybrid_slam {

/// A beam's end as seen from the robot, and how likely it ended there without a wall of the map.
struct Beam {
    Point2 end = Point2::Zero();  ///< metres
    double otherwise = 0.0;
};

/// Beams spread evenly over the points of a sweep: the nearer one ended, the less it tells.
std::vector<Beam> beams_of(const Sweep& sweep, const ParticleFilterConfig& config);

struct BeamsFit {
    double log_likelihood = 0.0;  ///< of all beams together
    double mean = 0.0;            ///< likelihood at a wall, 0 to 1
};

/// The likelihood field of Thrun et al. 2005, table 6.3, by the distance to the nearest wall's
/// line. That of the search's pyramid would be quicker, but is blurred from whole cells: of two
/// look-alike halls, of which one lies on the lines of the grid, one scan then favours that one by
/// a factor of 5.
class BeamField {
  public:
    BeamField(const ReferenceMap& map, double hit);

    /// At least one beam.
    BeamsFit fit_of(const std::vector<Beam>& beams, const Pose2d& map_from_robot) const;

  private:
    double likelihood(const Point2& point) const;

    const ReferenceMap& map_;
    double hit_;
    static constexpr int kSteps = 256;
    std::array<double, kSteps> bell_{};  ///< by the squared distance
};

}  // namespace hybrid_slam
