// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "hybrid_slam/localization/reference_map.hpp"

namespace hybrid_slam {

/// What one scan saw: the laser's place and what its beams hit, both in the frame of the query,
/// which is the robot's at the newest scan.
struct Sweep {
    Point2 origin = Point2::Zero();  ///< of the beams
    Surface surface;
};

/// The newest scan first and, when one is not enough, earlier ones of the same drive tied by
/// odometry.
using Query = std::vector<Sweep>;

/// The same seen from frame a.
Sweep transform(const Pose2d& a_from_b, const Sweep& sweep_in_b);

/// What the map says of the beams of a query at one pose. Of a large query some hundred points,
/// evenly spread, are judged; their four shares add up to one, but are 0 of a blind query.
struct ScanFit {
    std::size_t points = 0;  ///< of the query; 0: it was blind
    double explained = 0.0;  ///< end at a wall of the map
    double violated = 0.0;   ///< went through a wall of the map, or end inside of one
    /// Of the violated: those that end at another wall. By chance few do: a door is open.
    double beyond = 0.0;
    double unmapped = 0.0;  ///< end in the open: things the map does not have
    double unknown = 0.0;   ///< end where the map knows nothing
    double rms = 0.0;       ///< metres across the walls, of those explained
    /// 0 to 1: 1 when all is explained, 0 when what is against() it outweighs that; unknown counts
    /// half.
    double score = 0.0;

    /// Share that speaks against the pose: walls that are seen through, but what is seen beyond at
    /// its proper place half speaks for it. May be negative.
    double against() const { return violated - 1.5 * beyond; }
};

/// `gate` (metres): how far from a wall a point may end to be explained by it.
ScanFit fit_of(const ReferenceMap& map, const Query& query, const Pose2d& map_from_query,
               double gate = 0.1);

}  // namespace hybrid_slam
