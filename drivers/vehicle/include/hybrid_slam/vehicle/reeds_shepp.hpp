// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hybrid_slam/core/points.hpp"
#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {

/// A piece of a way with a constant steering angle.
struct Arc {
    double length = 0.0;     ///< metres, negative is backwards
    double curvature = 0.0;  ///< 1/m, heading change per signed length: left positive
};

using Arcs = std::vector<Arc>;

/// The pose at the end of the arcs, seen from their beginning.
Pose2d end_of(const Arcs& arcs);

/// Metres, backwards counted as well.
double length_of(const Arcs& arcs);

/// Ways from the origin to `goal` with arcs of `radius` and straight lines (Reeds and Shepp 1990),
/// forwards and backwards, shortest first; the first is the shortest way that there is. Throws
/// Error for a radius that is not positive.
std::vector<Arcs> reeds_shepp_ways(const Pose2d& goal, double radius);

/// Length of the first of them.
double reeds_shepp_length(const Pose2d& goal, double radius);

/// Ways to a position that is met with any heading: one arc of `radius` and a straight line, each
/// forwards or backwards. None for positions inside of both turning circles.
std::vector<Arcs> ways_to_position(const Point2& goal, double radius);

}  // namespace hybrid_slam
