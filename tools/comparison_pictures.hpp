// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "canvas.hpp"
#include "comparison.hpp"

namespace hybrid_slam::tools {

/// The colour of a variant in all pictures of a comparison, by its place.
Color variant_color(const Comparison& comparison, std::size_t run);

/// All trajectories over the map of the best variant.
Canvas draw_paths(const Comparison& comparison);
/// What each variant made of the drive, side by side.
Canvas draw_maps(const Comparison& comparison);
/// Errors, or differences where there is no truth, over time.
Canvas draw_errors(const Comparison& comparison);

}  // namespace hybrid_slam::tools
