// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "hybrid_slam/sensors/robot.hpp"
#include "hybrid_slam/sensors/sensor_event.hpp"

namespace hybrid_slam {

/// The devices of a simulated robot on a lockstep clock: the bytes come over the same lines as
/// those of LiveSensors, their arrivals from the clock. The same run gives the same stream.
class LockstepSensors : public SensorStream {
  public:
    /// Opens robot.lidar.port and, when the robot has a camera, robot.camera.device, and then
    /// connects to the clock at `url`. Throws Error when one of them is not there.
    LockstepSensors(const RobotConfig& robot, const std::string& url);
    ~LockstepSensors() override;

    /// Waits for the next event; empty when the simulator has ended. Throws Error when a device is
    /// gone or does not give what the clock announced.
    std::optional<SensorEvent> next() override;

    /// The next event, or empty after `timeout` seconds.
    std::optional<SensorEvent> next_within(double timeout);

    /// True when next will return nothing any more.
    bool ended() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
