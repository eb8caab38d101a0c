// SPDX-License-Identifier: Apache-2.0
#include "command_watchdog.hpp"

#include <algorithm>

namespace hybrid_slam {

void CommandWatchdog::set(const DriveCommand& command, double now) {
    command_ = command;
    ends_ = now + command_valid_;
    any_ = true;
}

void CommandWatchdog::stop(double now) {
    ends_ = std::min(ends_, now);
}

CommandWatchdog::Order CommandWatchdog::order(double now) const {
    if (!any_ || now >= ends_ + release_after_) {
        return {};
    }
    if (now < ends_) {
        return {command_, true, CanDriveState::kDriving};
    }
    // The wheel stays: straightening it while the truck rolls out would leave the path.
    return {{0.0, command_.steering}, true, CanDriveState::kStopping};
}

}  // namespace hybrid_slam
