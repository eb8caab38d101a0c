// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "hybrid_slam/lidar/byte_source.hpp"
#include "hybrid_slam/sensors/robot.hpp"
#include "hybrid_slam/sensors/sensor_event.hpp"

namespace hybrid_slam {

enum class DeviceState {
    kOff,         ///< not asked for, or files that have ended
    kConnecting,  ///< not opened yet, or being reopened
    kStreaming,
    kSilent,     ///< open, but nothing comes
    kUnreadable  ///< bytes come, but no telegram: most likely the wrong baud rate
};
std::string_view to_string(DeviceState state);

/// How one device is.
struct DeviceStatus {
    DeviceState state = DeviceState::kOff;
    /// One line for people: what is wrong and what to look at; stays the same while that does.
    /// Empty while all is well.
    std::string detail;
    std::uint64_t connects = 0;  ///< how often it could be opened
    std::uint64_t dropped = 0;   ///< events that found the queue full
};

struct LiveStatus {
    DeviceStatus lidar;
    DeviceStatus camera;
    /// No images although a camera is configured: going on with the lidar alone.
    bool lidar_only = false;
};

struct LiveOptions {
    double retry_every = 1.0;              ///< seconds between attempts to open a device
    double silent_after = 1.0;             ///< seconds without a byte
    double unreadable_after = 2.0;         ///< seconds of bytes without a telegram
    std::size_t most_lidar_events = 4096;  ///< waiting in the queue
    std::size_t most_images = 30;          ///< waiting in the queue; the oldest go first
    /// How devices are opened; tests put fakes here.
    std::function<std::unique_ptr<ByteSource>(const LidarConfig&)> open_lidar = open_byte_source;
    std::function<std::unique_ptr<Capture>(const CameraConfig&)> open_camera = open_capture;
    /// Seconds; asked by several threads. Empty = wall clock at the start, steady from there on.
    std::function<double()> now;
};

/// The devices of a robot, each read by a thread of its own that reopens it for as long as it
/// takes. Arrivals are taken in the reading thread. When the consumer falls behind, images go first
/// (their queue is short), the oldest before the newer ones; all losses are counted.
class LiveSensors : public SensorStream {
  public:
    explicit LiveSensors(const RobotConfig& robot, LiveOptions options = {});
    /// Within a fraction of a second: a thread that a driver does not let go is left to end by
    /// itself, and touches nothing but its own device then.
    ~LiveSensors() override;

    /// Waits for the next event; empty when `stop` was called, or when a lidar that is a file has
    /// ended. Arrivals never go back.
    std::optional<SensorEvent> next() override;

    /// The next event, or empty after `timeout` seconds.
    std::optional<SensorEvent> next_within(double timeout);

    /// True when next will return nothing any more.
    bool ended() const;
    /// From any thread; next returns empty from then on.
    void stop();
    LiveStatus status() const;
    /// Seconds of the clock that arrivals are of.
    double now() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
