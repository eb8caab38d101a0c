// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/camera/capture.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <string_view>
#include <thread>

#include "captures.hpp"
#include "mjpeg_url.hpp"

namespace hybrid_slam {

bool Pace::wait(double timeout) {
    const decltype(due_) now = Clock::now();
    const auto until = now + Seconds(timeout);
    std::this_thread::sleep_until(std::min(due_, until));
    if (due_ > until) {
        return false;
    }
    due_ = std::max(due_, now) + period_;
    return true;
}

std::unique_ptr<Capture> open_capture(const CameraConfig& config) {
    const auto begins = [&config](std::string_view scheme) {
        return config.device.compare(0, scheme.size(), scheme) == 0;
    };
    if (begins(kHttpScheme) || begins(kHttpsScheme)) {
        return open_mjpeg_capture(config);
    }
    std::error_code error;
    const auto status = std::filesystem::status(config.device, error);
    if (std::filesystem::is_directory(status)) {
        return open_image_folder(config);
    }
    if (std::filesystem::is_regular_file(status)) {
        return open_video_file(config);
    }
    return open_video_device(config);
}

}  // namespace hybrid_slam
