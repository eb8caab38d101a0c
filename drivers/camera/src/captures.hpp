// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>

#include "hybrid_slam/camera/capture.hpp"

namespace hybrid_slam {

// The kinds of capture; open_capture chooses. Each throws Error with the device's name.

std::unique_ptr<Capture> open_video_device(const CameraConfig& config);
std::unique_ptr<Capture> open_video_file(const CameraConfig& config);
std::unique_ptr<Capture> open_image_folder(const CameraConfig& config);
/// An MJPEG stream over HTTP.
std::unique_ptr<Capture> open_mjpeg_capture(const CameraConfig& config);

/// The pace of files, which would come all at once: one image each 1/rate seconds, the first one
/// now. Who was kept waiting does not catch up.
class Pace {
  public:
    explicit Pace(double rate) : period_(1.0 / rate) {}

    /// Waits for the next image's turn, at most `timeout` seconds; false when it is not yet.
    bool wait(double timeout);

  private:
    using Clock = std::chrono::steady_clock;
    using Seconds = std::chrono::duration<double>;

    Seconds period_;
    std::chrono::time_point<Clock, Seconds> due_;
};

}  // namespace hybrid_slam
