// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hybrid_slam/core/points.hpp"
#include "hybrid_slam/registration/nearest_neighbors.hpp"

namespace hybrid_slam {

/// Points on walls with the direction across each wall. A zero normal says that the direction is
/// not known there (a post, a lone beam).
struct Surface {
    Points points;   ///< metres
    Points normals;  ///< unit vectors or zero; as many as points

    std::size_t size() const { return points.size(); }
    void append(const Surface& other);
};

/// The points whose normal is known.
Surface oriented(const Surface& surface);

/// The same surface, its coordinates taken from frame b to frame a.
Surface transform(const Pose2d& a_from_b, const Surface& surface_in_b);

struct NormalConfig {
    double radius = 0.15;  ///< metres; neighbours along the scan up to here support a normal
    double radius_per_metre = 0.06;  ///< metres per metre of range, where beams lie farther apart
    double max_spread = 0.35;  ///< a normal is kept when the spread across / along is at most this
};

/// Normals of points in the order of the beams: principal directions over the neighbours in that
/// order. The normals face `viewpoint`.
Surface with_normals(Points points_in_beam_order, const Point2& viewpoint,
                     const NormalConfig& config = {});

/// What ICP aligns to: a surface and the search tree over it, built once.
class Reference {
  public:
    /// Throws Error when the surface is empty.
    explicit Reference(Surface surface);

    const Surface& surface() const { return surface_; }
    const NearestNeighbors& neighbors() const { return neighbors_; }

  private:
    Surface surface_;
    NearestNeighbors neighbors_;
};

}  // namespace hybrid_slam
