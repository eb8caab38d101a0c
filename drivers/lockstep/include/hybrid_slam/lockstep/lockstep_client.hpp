// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

namespace hybrid_slam {

struct LockstepTick {
    double now = 0.0;       ///< seconds
    bool pose_due = false;  ///< the pose of a scan that was sent is to be waited for
    /// So many frames were put on the CAN bus since the last tick: to be waited for too, because a
    /// pseudo-terminal hands bytes on when it likes to.
    std::size_t frames = 0;
};

/// The drive's end of a LockstepServer: it does nothing between two ticks.
class LockstepDriveClock {
  public:
    /// `url` as of LockstepServer. Throws Error when nobody listens there.
    explicit LockstepDriveClock(const std::string& url);
    ~LockstepDriveClock();
    LockstepDriveClock(const LockstepDriveClock&) = delete;
    LockstepDriveClock& operator=(const LockstepDriveClock&) = delete;

    /// Waits for the next tick; empty when the simulator ended, or after `timeout` seconds.
    std::optional<LockstepTick> next(double timeout = 3600.0);
    /// So many frames of this tick have been written to the bus.
    void done(std::size_t frames);
    /// The simulator ended: next will return nothing any more.
    bool ended() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// What the simulator has put on one of the sensors' lines.
struct LockstepArrival {
    enum class What { kLidar, kImage };
    What what = What::kLidar;
    double arrival = 0.0;   ///< seconds
    std::size_t bytes = 0;  ///< of the lidar
};

/// The sensors' end of a LockstepServer; see LockstepSensors for the stream made of it.
class LockstepSensorClock {
  public:
    /// Connect when the devices are open: what is put on a line before is lost.
    explicit LockstepSensorClock(const std::string& url);
    ~LockstepSensorClock();
    LockstepSensorClock(const LockstepSensorClock&) = delete;
    LockstepSensorClock& operator=(const LockstepSensorClock&) = delete;

    /// Waits for the next arrival; empty when the simulator ended, or after `timeout` seconds.
    std::optional<LockstepArrival> next(double timeout = 3600.0);
    /// It has been read from its line.
    void done();
    bool ended() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace hybrid_slam
