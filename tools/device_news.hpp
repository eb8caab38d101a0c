// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "hybrid_slam/live/live_sensors.hpp"

namespace hybrid_slam::tools {

/// Says in messages what changes about live devices, once for each change.
class DeviceNews {
  public:
    /// `before_saying` is called before each message.
    explicit DeviceNews(std::function<void()> before_saying = {});

    void look(const LiveStatus& status);
    /// Telegrams without a scan in them for seconds, and scans again. `now` in seconds.
    void look(const LidarCounts& counts, double now);
    /// Why images are dropped; empty when they are not, which is said when it has been so for
    /// seconds. `now` in seconds.
    void look_at_images(const std::string& trouble, double now);

  private:
    void look(const std::string& device, const DeviceStatus& status, DeviceStatus& said);
    void say(bool good, const std::string& text) const;

    std::function<void()> before_saying_;
    LiveStatus said_;
    LidarCounts at_last_scan_;
    double last_scan_ = 0.0;
    bool scans_missing_ = false;
    std::string image_trouble_;
    double last_image_trouble_ = 0.0;
};

}  // namespace hybrid_slam::tools
