// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hybrid_slam/core/config.hpp"

namespace hybrid_slam {

/// How the simulated scene looks to the camera; what is random in it is seeded.
struct RenderConfig {
    double exposure = 0.01;       ///< seconds that the shutter is open; motion smears by it
    double brightness = 1.0;      ///< scale of all gray levels
    double noise_sigma = 2.5;     ///< gray levels of each channel, at gray level 128
    double blur = 0.35;           ///< pixels, standard deviation of the lens
    double vignetting = 0.3;      ///< share of the light that is missing in the corners
    double floor_tile = 0.6;      ///< metres; joints lie at its multiples in the world
    double bare_floor = 0.4;      ///< share of the floor that shows hardly any texture
    double plain_walls = 0.4;     ///< share of the walls that show hardly any texture
    double dirt = 1.0;            ///< strength of speckle, stains and scratches; 0 = all is clean
    double shine = 0.35;          ///< how strongly smooth floor mirrors the lamps
    double wall_height = 3.0;     ///< metres
    double ceiling_height = 6.0;  ///< metres; above the walls the hall goes on
    int jpeg_quality = 85;        ///< of whoever encodes the images
    /// Faults, as pairs from, to: seconds of the drive.
    std::vector<double> covered;  ///< something lies over the lens
    std::vector<double> dimmed;   ///< the lamps give half their light, at once
};

/// Lists the keys without a section before them.
void describe(ConfigSchema& schema, RenderConfig& config);

}  // namespace hybrid_slam
