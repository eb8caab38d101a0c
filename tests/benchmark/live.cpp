// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <ostream>
#include <random>
#include <thread>
#include <vector>

#include "benchmarks.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/io/pseudo_terminal.hpp"
#include "hybrid_slam/lidar/lidar_reader.hpp"
#include "hybrid_slam/live/live_sensors.hpp"

namespace hybrid_slam {
namespace {

constexpr std::size_t kBeams = 541;
constexpr std::uint32_t kCountStep = 2;     // a telegram for every second turn: 12.5 Hz
constexpr double kClockError = 0.003;       // by which the scanner's seconds are longer than ours
constexpr double kMostJitter = 0.030;       // seconds
constexpr double kSettling = 60.0;          // seconds
constexpr double kAskedError = 1e-3;        // seconds, afterwards
constexpr std::uint32_t kDigitBase = 1000;  // the first two words tell which scan it is
constexpr std::uint32_t kNearest = 100;     // centimetres

std::vector<std::uint8_t> telegram_of(std::uint32_t index) {
    S300Telegram telegram;
    telegram.scan_number = 1000 + kCountStep * index;
    telegram.telegram_number = static_cast<std::uint16_t>(index);
    telegram.field = 1;
    telegram.words.assign(kBeams, 500);
    telegram.words[0] = static_cast<std::uint16_t>(kNearest + index / kDigitBase);
    telegram.words[1] = static_cast<std::uint16_t>(kNearest + index % kDigitBase);
    return encode(telegram);
}

std::size_t index_of(const Scan& scan) {
    const auto digit = [&scan](std::size_t beam) {
        return static_cast<std::size_t>(std::lround(scan.ranges.at(beam) * 100.0f)) - kNearest;
    };
    return digit(0) * kDigitBase + digit(1);
}

/// When a scanner with a clock of its own sees and sends. The truth is when its first beam was, not
/// when this machine came to write the bytes.
struct Schedule {
    LidarConfig lidar;
    double begin = 0.0;  ///< seconds

    double period() const { return kCountStep * lidar.count_period * (1.0 + kClockError); }
    double first_beam(std::size_t index) const {
        return begin + static_cast<double>(index) * period();
    }
    double last_byte(std::size_t index, std::size_t bytes) const {
        return first_beam(index) + lidar.latency + lidar.wire_time(bytes);
    }
};

/// Sends in real time, each telegram late by random; returns by how many seconds this machine was
/// later still, at the most.
double send(PseudoTerminal& terminal, const Schedule& schedule, std::size_t scans) {
    std::mt19937 random(12);
    std::uniform_real_distribution<double> jitter(0.0, kMostJitter);
    double worst = 0.0;
    for (std::size_t i = 0; i < scans; ++i) {
        const auto bytes = telegram_of(static_cast<std::uint32_t>(i));
        const double due = schedule.last_byte(i, bytes.size()) + jitter(random);
        const double wait = std::max(0.0, due - steady_seconds());
        std::this_thread::sleep_for(std::chrono::duration<double>(wait));
        worst = std::max(worst, steady_seconds() - due);
        terminal.write(bytes);
    }
    return worst;
}

struct Errors {
    double worst = 0.0;  ///< seconds
    double square_sum = 0.0;
    std::size_t count = 0;

    void add(double error) {
        worst = std::max(worst, std::abs(error));
        square_sum += error * error;
        ++count;
    }
    double rms() const {
        return count > 0 ? std::sqrt(square_sum / static_cast<double>(count)) : 0.0;
    }
};

struct Tally {
    std::size_t received = 0;
    Errors early;     ///< of stamps in the first minute
    Errors settled;   ///< afterwards
    Errors arrivals;  ///< what stamps by arrival alone would have had, afterwards
};

/// Takes scans until `sender` has sent the last one and nothing more comes.
Tally receive(LiveSensors& sensors, const Schedule& schedule, const std::future<double>& sender) {
    LidarReader reader(schedule.lidar);
    const std::size_t size = telegram_of(0).size();
    Tally tally;
    for (;;) {
        const auto event = sensors.next_within(1.0);
        if (!event) {
            if (sender.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
                return tally;
            }
            continue;
        }
        const auto& bytes = std::get<LidarBytes>(*event);
        reader.push(bytes);
        while (const auto scan = reader.next()) {
            const std::size_t index = index_of(*scan);
            const double truth = schedule.first_beam(index);
            const bool settled = truth - schedule.begin >= kSettling;
            (settled ? tally.settled : tally.early).add(scan->stamp - truth);
            if (settled) {
                tally.arrivals.add(bytes.arrival - schedule.last_byte(index, size));
            }
            ++tally.received;
        }
    }
}

void wait_for_reader(const LiveSensors& sensors) {
    constexpr int kTenSeconds = 1000;
    for (int i = 0; sensors.status().lidar.connects == 0; ++i) {
        if (i == kTenSeconds) {
            throw Error("live: " + sensors.status().lidar.detail);
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
}

}  // namespace

int run_live_benchmark(double minutes, std::ostream& out) {
    PseudoTerminal terminal;
    RobotConfig robot;
    robot.lidar.port = terminal.path();
    robot.camera.enabled = false;
    LiveOptions options;
    options.now = steady_seconds;
    LiveSensors sensors(robot, options);
    wait_for_reader(sensors);

    const Schedule schedule{robot.lidar, steady_seconds() + 0.1};
    const auto scans = static_cast<std::size_t>(60.0 * minutes / schedule.period());
    std::future<double> sender = std::async(std::launch::async, [&terminal, &schedule, scans] {
        return send(terminal, schedule, scans);
    });
    const Tally tally = receive(sensors, schedule, sender);
    const double oversleep = sender.get();

    const std::size_t lost = scans - std::min(scans, tally.received);
    const bool all = tally.received == scans;
    const bool exact = tally.settled.count > 0 && tally.settled.worst <= kAskedError;
    out << fmt::format(
        "| live through a pseudo-terminal, {:g} min at 12.5 Hz, arrivals late by 0 to 30 ms, clock "
        "off by 0.3 % | measured | asked | verdict |\n|---|---|---|---|\n",
        minutes);
    out << fmt::format("| scans sent, received | {}, {} | | |\n", scans, tally.received);
    out << fmt::format("| lost | {} | 0 | {} |\n", lost, all ? "ok" : "MISS");
    out << fmt::format("| stamp error after 60 s, worst | {:.3f} ms | {:.0f} ms | {} |\n",
                       1e3 * tally.settled.worst, 1e3 * kAskedError, exact ? "ok" : "MISS");
    out << fmt::format("| stamp error after 60 s, rms | {:.3f} ms | | |\n",
                       1e3 * tally.settled.rms());
    out << fmt::format("| stamp error in the first 60 s, worst, rms | {:.3f}, {:.3f} ms | | |\n",
                       1e3 * tally.early.worst, 1e3 * tally.early.rms());
    out << fmt::format("| by arrival alone, worst, rms | {:.3f}, {:.3f} ms | | |\n",
                       1e3 * tally.arrivals.worst, 1e3 * tally.arrivals.rms());
    out << fmt::format("| sender late by this machine's load, worst | {:.3f} ms | | |\n",
                       1e3 * oversleep);
    return (all ? 0 : 1) + (exact ? 0 : 1);
}

}  // namespace hybrid_slam
