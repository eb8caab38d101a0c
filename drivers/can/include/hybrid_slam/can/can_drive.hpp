// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <string>

#include "hybrid_slam/can/can_bus.hpp"
#include "hybrid_slam/can/drive_codec.hpp"

namespace hybrid_slam {

/// A truck on a CAN bus: the section `can` of a vehicle's file.
struct CanDriveConfig {
    CanConfig bus;
    DriveLayout layout;
    double rate = 50.0;           ///< commands per second
    double command_valid = 0.2;   ///< seconds that a command holds; then speed zero
    double release_after = 1.0;   ///< seconds of speed zero before power goes off
    double feedback_valid = 0.5;  ///< seconds; a truck that is silent for longer is not driven
};

/// Lists the keys without a section before them.
void describe(ConfigSchema& schema, CanDriveConfig& config);

enum class CanDriveState {
    kOff,       ///< power off, brakes on: nobody commands
    kStopping,  ///< speed zero is sent: commands ended
    kDriving,   ///< the newest command is sent
    kHeld,      ///< commands come, but speed zero is sent: `reason`
    kFault      ///< the bus broke: nothing is sent any more
};

struct CanDriveStatus {
    CanDriveState state = CanDriveState::kOff;
    std::string reason;  ///< what broke, or why it is or would be held; empty: it may be driven
    DriveCommand sent;   ///< the last that was sent
    DriveFeedback feedback;
    double feedback_age = std::numeric_limits<double>::infinity();  ///< seconds
    CanCounts counts;
};

/// Drives a truck in a thread of its own, at a fixed rate with the newest command. Commands that
/// stop coming stop the truck; so does its silence or a fault that it tells. A bus that broke stays
/// so: make a new one.
class CanDrive {
  public:
    /// Seconds that never go back.
    using Clock = std::function<double()>;

    /// Sends nothing but speed zero and power off until a command comes. With a clock there is no
    /// thread: whoever has the clock calls `step` for each cycle. Throws Error for a layout that
    /// does not work.
    CanDrive(std::unique_ptr<CanBus> bus, const CanDriveConfig& config,
             const VehicleConfig& vehicle, const Clock& clock = {});
    /// Sends speed zero, then power off, without waiting for the truck to stand.
    ~CanDrive();
    CanDrive(const CanDrive&) = delete;
    CanDrive& operator=(const CanDrive&) = delete;

    /// Holds for `command_valid` from now. Throws Error when it is not finite, which stops the
    /// truck too. Any thread.
    void set_command(const DriveCommand& command);
    /// Speed zero from the next cycle on, with the wheel where it was sent last. Any thread.
    void stop();
    /// While others drive, by hand: nothing is sent once power has been taken off. Any thread.
    void set_silent(bool silent);
    /// Any thread.
    CanDriveStatus status() const;

    /// One cycle, of a drive with a clock: takes the frames that came, of which it waits for
    /// `frames`, and sends what is due now.
    void step(std::size_t frames = 0);

  private:
    struct Shared;
    std::unique_ptr<Shared> shared_;
};

}  // namespace hybrid_slam
