// SPDX-License-Identifier: Apache-2.0
#include "command_watchdog.hpp"

#include <gtest/gtest.h>

namespace hybrid_slam {
namespace {

TEST(CommandWatchdog, IsOffUntilACommandComes) {
    const CommandWatchdog watchdog(0.2, 1.0);
    for (const double now : {0.0, 0.1, 1e6}) {
        const auto order = watchdog.order(now);
        EXPECT_EQ(order.state, CanDriveState::kOff);
        EXPECT_FALSE(order.enabled);
        EXPECT_EQ(order.command.speed, 0.0);
    }
}

TEST(CommandWatchdog, ACommandHoldsThenSpeedIsZeroThenPowerGoes) {
    CommandWatchdog watchdog(0.2, 1.0);
    watchdog.set({0.3, 0.5}, 100.0);
    for (double now = 100.0; now < 103.0; now += 0.0101) {
        const auto order = watchdog.order(now);
        const bool valid = now < 100.2;
        EXPECT_EQ(order.command.speed, valid ? 0.3 : 0.0) << now;
        EXPECT_EQ(order.enabled, now < 101.2) << now;
        EXPECT_EQ(order.command.steering, now < 101.2 ? 0.5 : 0.0) << now;
        EXPECT_EQ(order.state, valid           ? CanDriveState::kDriving
                               : order.enabled ? CanDriveState::kStopping
                                               : CanDriveState::kOff)
            << now;
    }
}

TEST(CommandWatchdog, TheNewestCommandCounts) {
    CommandWatchdog watchdog(0.2, 1.0);
    watchdog.set({0.3, 0.5}, 0.0);
    watchdog.set({-0.1, 0.0}, 0.15);
    EXPECT_EQ(watchdog.order(0.3).command.speed, -0.1);
    EXPECT_EQ(watchdog.order(0.36).command.speed, 0.0);
    watchdog.set({0.2, 0.0}, 50.0);
    EXPECT_EQ(watchdog.order(50.0).state, CanDriveState::kDriving) << "from off again";
}

TEST(CommandWatchdog, StopEndsACommandAtOnceAndProlongsNothing) {
    CommandWatchdog watchdog(0.2, 1.0);
    watchdog.stop(5.0);
    EXPECT_EQ(watchdog.order(5.0).state, CanDriveState::kOff) << "nothing to stop";
    watchdog.set({0.3, 0.5}, 10.0);
    watchdog.stop(10.1);
    EXPECT_EQ(watchdog.order(10.1).command.speed, 0.0);
    EXPECT_EQ(watchdog.order(10.1).state, CanDriveState::kStopping);
    watchdog.stop(11.0);
    EXPECT_EQ(watchdog.order(11.2).state, CanDriveState::kOff);
}

}  // namespace
}  // namespace hybrid_slam
