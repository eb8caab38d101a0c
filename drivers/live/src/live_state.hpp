// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <utility>

#include "event_queue.hpp"
#include "hybrid_slam/live/live_sensors.hpp"

namespace hybrid_slam {

/// What the reading threads and the consumer share.
class LiveState {
  public:
    LiveState(const RobotConfig& robot, LiveOptions options);

    const RobotConfig robot;
    const LiveOptions options;

    void stop();
    bool stopping() const;
    /// True when it was told to stop before the seconds were over.
    bool wait_for_stop(double seconds);

    // For the reading threads.

    template <typename Event>
    void push(Event event) {
        {
            const std::lock_guard<std::mutex> lock(mutex_);
            if (stopped_ || lidar_ended_) {
                return;
            }
            DeviceStatus& device = device_of(event);
            device.dropped += queue_.push(std::move(event));
        }
        changed_.notify_all();
    }
    void lidar_opened();
    void set_lidar(DeviceState state, const std::string& detail);
    void end_lidar();
    void camera_opened();
    void camera_streams();
    /// `what` is wrong; that the lidar goes on alone is added.
    void camera_lost(DeviceState state, const std::string& what);

    // For the consumer.

    /// Waits for an event, without `timeout` for as long as it takes.
    std::optional<SensorEvent> pop(std::optional<double> timeout);
    bool over() const;
    LiveStatus status() const;

  private:
    DeviceStatus& device_of(const LidarBytes&) { return status_.lidar; }
    DeviceStatus& device_of(const CameraFrame&) { return status_.camera; }
    bool is_over() const { return stopped_ || (lidar_ended_ && queue_.empty()); }

    mutable std::mutex mutex_;  // of all below
    std::condition_variable changed_;
    std::condition_variable stop_told_;
    EventQueue queue_;
    LiveStatus status_;
    bool stopped_ = false;
    bool lidar_ended_ = false;
};

// What the threads run until `state` is told to stop.

void run_lidar(LiveState& state);
void run_camera(LiveState& state);

}  // namespace hybrid_slam
