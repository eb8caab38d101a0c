// SPDX-License-Identifier: Apache-2.0
#include "simulated_s300.hpp"

#include <algorithm>
#include <cmath>

namespace hybrid_slam {
namespace {

constexpr double kFieldOfView = radians(270.0);
constexpr std::uint32_t kCountsPerScan = 2;  ///< one telegram every two turns of the mirror
constexpr std::uint32_t kFirstCount = 1000;
constexpr double kFirstScan = 0.01;  ///< seconds
constexpr std::uint16_t kProtectiveBit = 0x4000;
/// Streams of random numbers that do not disturb each other.
constexpr std::uint64_t kRangeStream = std::uint64_t{2} << 32U;
constexpr std::uint64_t kBusStream = std::uint64_t{3} << 32U;

std::uint64_t stream(std::uint64_t number, int seed) {
    return number + static_cast<std::uint64_t>(seed);
}

/// The fan counter-clockwise, whichever way the scanner is mounted.
BeamFan fan_of(const LidarConfig& lidar) {
    const double steps = std::round(kFieldOfView / lidar.angle_step);
    BeamFan fan;
    fan.angle_increment = lidar.angle_step;
    fan.angle_min = lidar.angle_offset - steps * lidar.angle_step / 2.0;
    fan.beams = static_cast<std::size_t>(steps) + 1;
    return fan;
}

}  // namespace

SimulatedS300::SimulatedS300(const World& world, const Motion& motion, const LidarConfig& lidar,
                             const SimulatedDriveConfig& config)
    : world_(world),
      motion_(motion),
      lidar_(lidar),
      config_(config),
      fan_(fan_of(lidar)),
      range_noise_(stream(kRangeStream, config.seed)),
      bus_noise_(stream(kBusStream, config.seed)) {
    const double error = config.clock_error * (2.0 * bus_noise_.uniform() - 1.0);
    period_ = kCountsPerScan * lidar.count_period * (1.0 + error);
}

double SimulatedS300::next_stamp() const {
    return kFirstScan + static_cast<double>(scans_) * period_;
}

double SimulatedS300::next_end() const {
    return next_stamp() + lidar_.turn_time;
}

/// In the order of time. An inverted scanner turns the other way: its beams are cast as a fan that
/// is swept backwards.
std::vector<double> SimulatedS300::true_ranges() const {
    const double start = next_stamp();
    const double sweep = static_cast<double>(fan_.beams - 1) * lidar_.time_increment();
    const Pose2d robot_from_laser = lidar_.robot_from_laser();
    const Pose2d first = motion_.world_from_robot(start) * robot_from_laser;
    const Pose2d last = motion_.world_from_robot(start + sweep) * robot_from_laser;
    const std::vector<Circle> people = world_.people_at(start + sweep / 2.0);
    if (!lidar_.upside_down) {
        return cast_fan(world_, MovingLaser{first, last}, fan_, people);
    }
    std::vector<double> ranges = cast_fan(world_, MovingLaser{last, first}, fan_, people);
    std::reverse(ranges.begin(), ranges.end());
    return ranges;
}

std::uint16_t SimulatedS300::word_of(double distance) {
    // Both numbers are drawn for every beam, so that the noise of one does not depend on the
    // others.
    const bool dropped = range_noise_.uniform() <= config_.dropout;
    const double range = distance + config_.range_bias + config_.range_sigma * range_noise_.gauss();
    if (dropped || !(distance < lidar_.range_max) || !(range < lidar_.range_max)) {
        return kS300NoReturn;
    }
    const double centimetres = std::round(100.0 * std::max(range, lidar_.range_min));
    auto word = static_cast<std::uint16_t>(centimetres);
    if (range < config_.protective_radius) {
        word |= kProtectiveBit;
    }
    return word;
}

LidarBytes SimulatedS300::next() {
    S300Telegram telegram;
    telegram.scan_number = kFirstCount + kCountsPerScan * scans_;
    telegram.telegram_number = static_cast<std::uint16_t>(scans_);
    telegram.field = 1;
    if (lidar_.address != 0) {
        telegram.address = static_cast<std::uint8_t>(lidar_.address);
    }
    const std::vector<double> ranges = true_ranges();
    telegram.words.reserve(ranges.size());
    for (const double range : ranges) {
        telegram.words.push_back(word_of(range));
    }
    LidarBytes arrived;
    arrived.bytes = encode(telegram);
    arrived.arrival = next_stamp() + lidar_.latency + lidar_.wire_time(arrived.bytes.size()) +
                      config_.lidar_jitter * bus_noise_.uniform();
    ++scans_;
    return arrived;
}

}  // namespace hybrid_slam
