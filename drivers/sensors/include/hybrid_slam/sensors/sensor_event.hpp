// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <variant>

#include "hybrid_slam/camera/capture.hpp"
#include "hybrid_slam/lidar/lidar_reader.hpp"

namespace hybrid_slam {

/// What a device said, as it came, with the time at which it came: what is recorded.
using SensorEvent = std::variant<LidarBytes, CameraFrame>;

inline double arrival_of(const SensorEvent& event) {
    return std::visit([](const auto& what) { return what.arrival; }, event);
}

/// Where such events come from: live devices, a recording, a simulated vehicle.
class SensorStream {
  public:
    SensorStream() = default;
    SensorStream(const SensorStream&) = delete;
    SensorStream& operator=(const SensorStream&) = delete;
    virtual ~SensorStream() = default;

    /// The next event in the order of arrival; empty at the end.
    virtual std::optional<SensorEvent> next() = 0;

    /// How much has been read, from 0 to 1; negative when there is no telling (live).
    virtual double progress() const { return -1.0; }
};

}  // namespace hybrid_slam
