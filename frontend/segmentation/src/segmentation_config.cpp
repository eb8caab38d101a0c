// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/segmentation/dnn_floor_segmenter.hpp"

namespace hybrid_slam {

void describe(ConfigSchema& schema, SegmentationConfig& config) {
    constexpr double kLarge = 1e6;
    schema.add("file", config.file, "ONNX network that tells floor from the rest; '' = none");
    schema.add("input_width", config.input_width, 1, 8192, "pixels, as the network wants them");
    schema.add("input_height", config.input_height, 1, 8192, "pixels");
    schema.add("mean", config.mean, -kLarge, kLarge,
               "gray levels taken off first: of each channel, or one of all");
    schema.add("scale", config.scale, -kLarge, kLarge, "factors then: of each channel, or of all");
    schema.add("swap_rb", config.swap_rb, "the network wants red first, then green and blue");
    schema.add("floor_classes", config.floor_classes, 0.0, kLarge,
               "numbers of the classes that are floor, from 0");
    schema.add("threshold", config.threshold, -kLarge, kLarge,
               "of a network with one channel: more is floor");
}

}  // namespace hybrid_slam
