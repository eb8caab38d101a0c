// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "hybrid_slam/lidar/s300_telegram.hpp"
#include "hybrid_slam/live/live_sensors.hpp"

namespace hybrid_slam {

/// What the bytes of an open line say of the lidar behind it. Times are those of the caller.
class LidarWatch {
  public:
    LidarWatch(const LidarConfig& config, const LiveOptions& options, double opened);

    /// What a read brought, also when it was nothing.
    void take(const std::vector<std::uint8_t>& bytes, double now);

    DeviceState state() const { return state_; }
    std::string detail() const;

  private:
    bool holds_telegram(const std::vector<std::uint8_t>& bytes);

    LidarConfig config_;
    double silent_after_;
    double unreadable_after_;
    S300Decoder decoder_;
    DeviceState state_ = DeviceState::kConnecting;
    bool understood_ = false;  // a telegram has come since it was opened
    double last_byte_;
    /// When bytes began to come without a telegram among them.
    double babbles_since_ = std::numeric_limits<double>::infinity();
};

}  // namespace hybrid_slam
