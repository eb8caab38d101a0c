// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid_slam/backend/map_folder.hpp"

namespace hybrid_slam {

/// Part of a map: inside of a polygon or all but that.
struct MapArea {
    Points polygon;        ///< corners in order, metres in the map; the last joins the first
    bool outside = false;  ///< what is not inside of the polygon

    bool contains(const Point2& point) const;
};

/// The keyframes whose pose is in the area with those of their points that are in it too, and the
/// poses of the trajectories there. Edges between them stay as they are. Where the way from one
/// part to another led through keyframes that are gone, one edge takes its place: of the ways with
/// the fewest edges, with the relative pose as it stands now, so that it pulls at nothing, and the
/// covariances along the way summed up. Throws Error for less than three corners and when no
/// keyframe is left.
SlamMap crop(const StoredMap& map, const MapArea& area);

}  // namespace hybrid_slam
