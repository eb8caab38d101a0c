// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include "hybrid_slam/sensors/sensor_event.hpp"

namespace hybrid_slam {

/// What waits for the consumer, in the order of arrival. Not for several threads by itself.
class EventQueue {
  public:
    EventQueue(std::size_t most_lidar_events, std::size_t most_images)
        : most_lidar_events_(most_lidar_events), most_images_(most_images) {}

    /// Each returns how many older ones it had to drop to make room.
    std::size_t push(LidarBytes bytes);
    std::size_t push(CameraFrame frame);

    std::optional<SensorEvent> pop();
    bool empty() const { return lidar_.empty() && images_.empty(); }

  private:
    std::deque<LidarBytes> lidar_;
    std::deque<CameraFrame> images_;
    std::size_t most_lidar_events_;
    std::size_t most_images_;
    double last_arrival_ = 0.0;  // of what was taken out
    bool any_taken_ = false;
};

}  // namespace hybrid_slam
