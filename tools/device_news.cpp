// SPDX-License-Identifier: Apache-2.0
#include "device_news.hpp"

#include <utility>

#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr double kPatience = 3.0;  ///< seconds of telegrams without a scan, of images undropped

/// Empty when no telegram came since.
std::string why_no_scans(const LidarCounts& before, const LidarCounts& now) {
    if (now.standby_scans > before.standby_scans) {
        return "the scanner stands by and measures nothing";
    }
    if (now.lockout_telegrams > before.lockout_telegrams) {
        return "the scanner is locked out and measures nothing";
    }
    if (now.without_distances > before.without_distances) {
        return "telegrams without distances: are they part of the scanner's continuous output?";
    }
    if (now.repeated_scans > before.repeated_scans) {
        return "the same scan again and again";
    }
    return now.stream.telegrams > before.stream.telegrams ? "telegrams come, but no scans" : "";
}

}  // namespace

DeviceNews::DeviceNews(std::function<void()> before_saying)
    : before_saying_(std::move(before_saying)) {}

void DeviceNews::look(const LiveStatus& status) {
    look("lidar", status.lidar, said_.lidar);
    look("camera", status.camera, said_.camera);
}

void DeviceNews::look(const std::string& device, const DeviceStatus& status, DeviceStatus& said) {
    if (status.state == said.state && status.detail == said.detail) {
        return;
    }
    const bool streaming = status.state == DeviceState::kStreaming;
    const bool at_start = said.state == DeviceState::kOff;
    say(streaming || at_start || status.state == DeviceState::kOff,
        device + ": " + (streaming ? "streaming" : status.detail));
    said = status;
}

void DeviceNews::look(const LidarCounts& counts, double now) {
    if (counts.scans != at_last_scan_.scans) {
        if (scans_missing_) {
            say(true, "lidar: scans again");
        }
        at_last_scan_ = counts;
        last_scan_ = now;
        scans_missing_ = false;
        return;
    }
    const std::string why = why_no_scans(at_last_scan_, counts);
    if (!scans_missing_ && now - last_scan_ > kPatience && !why.empty()) {
        say(false, "lidar: no scans: " + why);
        scans_missing_ = true;
    }
}

void DeviceNews::look_at_images(const std::string& trouble, double now) {
    if (!trouble.empty()) {
        last_image_trouble_ = now;
    }
    if (trouble == image_trouble_ || (trouble.empty() && now - last_image_trouble_ < kPatience)) {
        return;
    }
    say(trouble.empty(),
        trouble.empty() ? "images are recorded again" : "images are dropped: " + trouble);
    image_trouble_ = trouble;
}

void DeviceNews::say(bool good, const std::string& text) const {
    if (before_saying_) {
        before_saying_();
    }
    if (good) {
        print_info(text);
    } else {
        print_warning(text);
    }
}

}  // namespace hybrid_slam::tools
