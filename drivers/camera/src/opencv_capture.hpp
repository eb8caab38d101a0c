// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <string>

#include "hybrid_slam/camera/image_codec.hpp"

namespace hybrid_slam {

/// Keeps OpenCV from writing to stderr while it lives: a library never prints.
class QuietOpencv {
  public:
    QuietOpencv()
        : before_(cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT)) {}
    ~QuietOpencv() { cv::utils::logging::setLogLevel(before_); }
    QuietOpencv(const QuietOpencv&) = delete;
    QuietOpencv& operator=(const QuietOpencv&) = delete;

  private:
    cv::utils::logging::LogLevel before_;
};

/// A decoded frame as PNM. Throws Error with `name` for a kind of frame that is none of gray and
/// BGR with 8 bits.
EncodedImage pnm_of(const cv::Mat& frame, const std::string& name);

}  // namespace hybrid_slam
