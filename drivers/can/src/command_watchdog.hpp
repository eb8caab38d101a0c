// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid_slam/can/can_drive.hpp"

namespace hybrid_slam {

/// What to send at a time, by the age of the newest command. Times in seconds, never backwards.
class CommandWatchdog {
  public:
    CommandWatchdog(double command_valid, double release_after)
        : command_valid_(command_valid), release_after_(release_after) {}

    void set(const DriveCommand& command, double now);
    void stop(double now);

    struct Order {
        DriveCommand command;
        bool enabled = false;
        CanDriveState state = CanDriveState::kOff;
    };
    Order order(double now) const;

  private:
    double command_valid_;
    double release_after_;
    DriveCommand command_;
    double ends_ = 0.0;  // when the command ends
    bool any_ = false;
};

}  // namespace hybrid_slam
