// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "figure.hpp"
#include "hybrid_slam/localization/reference_map.hpp"

namespace hybrid_slam::tools {

/// The grid of a map under what is drawn on it; of a grid that lies aslant the walls alone.
void draw_map(Canvas& canvas, const View& view, const ReferenceMap& map);

}  // namespace hybrid_slam::tools
