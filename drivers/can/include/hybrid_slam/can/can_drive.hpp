// SPDX-License-Identifier: Apache-2.0
#pragma once

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
    std::string reason;  ///< why it is held or what broke; empty otherwise
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
    /// Sends nothing but speed zero and power off until a command comes. Throws Error for a layout
    /// that does not work.
    CanDrive(std::unique_ptr<CanBus> bus, const CanDriveConfig& config,
             const VehicleConfig& vehicle);
    /// Sends speed zero, then power off, without waiting for the truck to stand.
    ~CanDrive();
    CanDrive(const CanDrive&) = delete;
    CanDrive& operator=(const CanDrive&) = delete;

    /// Holds for `command_valid` from now. Throws Error when it is not finite, which stops the
    /// truck too. Any thread.
    void set_command(const DriveCommand& command);
    /// Speed zero from the next cycle on, with the wheel where it was sent last. Any thread.
    void stop();
    /// Any thread.
    CanDriveStatus status() const;

  private:
    struct Shared;
    std::unique_ptr<Shared> shared_;
};

}  // namespace hybrid_slam
