// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/vision/floor_mask.hpp"

namespace hybrid_slam {

/// A user's segmentation network and how it wants its images: resized, and each channel
/// (level - mean) * scale, in the network's order. The defaults are those of ImageNet.
struct SegmentationConfig {
    std::string file;                                   ///< ONNX; empty = no network
    int input_width = 320;                              ///< pixels
    int input_height = 240;                             ///< pixels
    std::vector<double> mean{123.675, 116.28, 103.53};  ///< gray levels of each channel, or of all
    std::vector<double> scale{0.0171248, 0.017507, 0.0174292};  ///< of each channel, or of all
    bool swap_rb = true;                                        ///< the network wants RGB
    std::vector<double> floor_classes{0.0};  ///< numbers of the classes that are floor
    double threshold = 0.5;                  ///< of a network with one channel: more is floor
};

/// Lists the keys without a section before them.
void describe(ConfigSchema& schema, SegmentationConfig& config);

/// Runs a network through OpenCV's DNN module, on the CPU. It has one input, 1 x 3 x height x
/// width, and its first output is 1 x classes x h x w: scores, of which the highest tells the
/// class, or of one channel the probability of floor. Output of another size than the image is
/// scaled to it.
class DnnFloorSegmenter : public FloorSegmenter {
  public:
    /// Tries the network once. Throws Error for a config without a file or out of range, a file
    /// that cannot be read or is no network, and for an output of another shape or without those
    /// classes.
    explicit DnnFloorSegmenter(const SegmentationConfig& config);
    ~DnnFloorSegmenter() override;

    /// Throws Error for an image that has not 1 or 3 channels or is empty.
    FloorMask segment(const Image& image) override;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
