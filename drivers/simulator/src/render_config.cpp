// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/simulator/render_config.hpp"

namespace hybrid_slam {

void describe(ConfigSchema& schema, RenderConfig& config) {
    schema.add("exposure", config.exposure, 0.0, 0.2, "s that the shutter is open");
    schema.add("brightness", config.brightness, 0.01, 10.0, "scale of all gray levels");
    schema.add("noise_sigma", config.noise_sigma, 0.0, 50.0, "gray levels at gray level 128");
    schema.add("blur", config.blur, 0.0, 3.0, "pixels, standard deviation of the lens");
    schema.add("vignetting", config.vignetting, 0.0, 1.0, "share of light missing in the corners");
    schema.add("floor_tile", config.floor_tile, 0.1, 5.0, "m, side of a tile");
    schema.add("bare_floor", config.bare_floor, 0.0, 1.0, "share with hardly any texture");
    schema.add("plain_walls", config.plain_walls, 0.0, 1.0, "share with hardly any texture");
    schema.add("dirt", config.dirt, 0.0, 3.0, "strength of speckle, stains and scratches");
    schema.add("shine", config.shine, 0.0, 2.0, "how strongly smooth floor mirrors the lamps");
    schema.add("wall_height", config.wall_height, 0.5, 50.0, "m");
    schema.add("ceiling_height", config.ceiling_height, 0.5, 100.0, "m, at least the wall's");
    schema.add("covered", config.covered, 0.0, 1e6, "pairs from, to in s: the lens is covered");
    schema.add("dimmed", config.dimmed, 0.0, 1e6, "pairs from, to in s: half the lamps' light");
    schema.add("jpeg_quality", config.jpeg_quality, 1, 100, "of the encoded images");
}

}  // namespace hybrid_slam
