// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

namespace hybrid_slam::test {

/// A frame of the default truck's bus (curtis) as `simulate --serve` logs it.
struct BusMoment {
    std::int64_t wall = 0;  ///< microseconds: since 1970, or of the virtual clock
    bool is_command = false;
    /// Of a command the motor's 1/min, which is 0 exactly when the truck is to stand; of a feedback
    /// the speed of the fixed axle in m/s.
    double value = 0.0;
};

/// Commands and feedbacks in the order of the log. Throws Error.
std::vector<BusMoment> read_bus(const std::filesystem::path& file);

/// What a fault did to a truck that drove.
struct Stopping {
    double speed_before = 0.0;      ///< m/s, what it drove at the fault
    std::optional<double> seconds;  ///< from the last valid input to the first command to stand
    double rolled = 0.0;            ///< metres after that command
    int moved_later = 0;            ///< commands to move after it, of which there must be none
};

/// Of what happened at `fault`, whose last valid input came at `last_valid`.
Stopping stopping_after(const std::vector<BusMoment>& bus, std::int64_t fault,
                        std::int64_t last_valid);

/// Speed of the feedback at or before a time; 0 before the first.
double speed_at(const std::vector<BusMoment>& bus, std::int64_t wall);
/// Metres that the truck went from then on, by its feedback.
double rolled_since(const std::vector<BusMoment>& bus, std::int64_t wall);
/// When the simulator's clock was 0: the truck speaks each 20 ms, from 20 ms on, and is heard a
/// little later.
std::int64_t epoch_of(const std::vector<BusMoment>& bus);

}  // namespace hybrid_slam::test
