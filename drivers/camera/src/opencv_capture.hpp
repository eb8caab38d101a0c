// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "hybrid_slam/camera/image_codec.hpp"

namespace hybrid_slam {

/// Keeps OpenCV from writing to stderr, in the whole process and for good: a library never prints.
/// Only the first call does something, so that who wants OpenCV's log can have it back.
void silence_opencv();

/// A decoded frame as PNM. Throws Error with `name` for a kind of frame that is none of gray and
/// BGR with 8 bits.
EncodedImage pnm_of(const cv::Mat& frame, const std::string& name);

}  // namespace hybrid_slam
