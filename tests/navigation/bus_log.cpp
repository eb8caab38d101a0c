// SPDX-License-Identifier: Apache-2.0
#include "navigation/bus_log.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hybrid_slam/can/candump.hpp"
#include "hybrid_slam/can/drive_codec.hpp"
#include "hybrid_slam/can/truck_can.hpp"

namespace hybrid_slam::test {
namespace {

constexpr std::uint32_t kCommand = 0x203;
constexpr std::uint32_t kFeedback = 0x183;

/// Unsigned, little endian; the direction is a flag of its own.
double rpm_of(const CanFrame& command) {
    return command.data[1] + 256.0 * command.data[2];
}

}  // namespace

std::vector<BusMoment> read_bus(const std::filesystem::path& file) {
    const auto codec = make_drive_codec(DriveLayout(), VehicleConfig());
    std::vector<BusMoment> bus;
    for (const CandumpLine& line : read_candump(file)) {
        const auto feedback = codec->decode(line.frame);
        if (line.frame.id == kCommand) {
            bus.push_back({line.microseconds, true, rpm_of(line.frame)});
        } else if (feedback && line.frame.id == kFeedback) {
            bus.push_back({line.microseconds, false, feedback->speed.value_or(0.0)});
        }
    }
    return bus;
}

double speed_at(const std::vector<BusMoment>& bus, std::int64_t wall) {
    double speed = 0.0;
    for (const BusMoment& moment : bus) {
        if (moment.wall > wall) {
            break;
        }
        speed = moment.is_command ? speed : moment.value;
    }
    return speed;
}

double rolled_since(const std::vector<BusMoment>& bus, std::int64_t wall) {
    double metres = 0.0;
    for (const BusMoment& moment : bus) {
        if (!moment.is_command && moment.wall > wall) {
            metres += std::abs(moment.value) * TruckCan::kFeedbackPeriod;
        }
    }
    return metres;
}

std::int64_t epoch_of(const std::vector<BusMoment>& bus) {
    std::int64_t epoch = std::numeric_limits<std::int64_t>::max();
    std::int64_t said = 0;
    for (const BusMoment& moment : bus) {
        if (!moment.is_command) {
            ++said;
            const std::int64_t after = std::llround(1e6 * TruckCan::kFeedbackPeriod);
            epoch = std::min(epoch, moment.wall - said * after);
        }
    }
    return epoch;
}

Stopping stopping_after(const std::vector<BusMoment>& bus, std::int64_t fault,
                        std::int64_t last_valid) {
    Stopping stopping;
    stopping.speed_before = std::abs(speed_at(bus, fault));
    std::int64_t stood = 0;
    for (const BusMoment& moment : bus) {
        if (!moment.is_command || moment.wall < fault) {
            continue;
        }
        if (!stopping.seconds && moment.value == 0.0) {
            stopping.seconds = 1e-6 * static_cast<double>(moment.wall - last_valid);
            stood = moment.wall;
        } else if (stopping.seconds && moment.value != 0.0) {
            ++stopping.moved_later;
        }
    }
    stopping.rolled = stopping.seconds ? rolled_since(bus, stood) : 0.0;
    return stopping;
}

}  // namespace hybrid_slam::test
