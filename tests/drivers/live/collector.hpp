// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <thread>
#include <vector>

#include "hybrid_slam/io/pseudo_terminal.hpp"
#include "hybrid_slam/live/live_sensors.hpp"
#include "streams.hpp"

namespace hybrid_slam::test {

/// Takes all that LiveSensors gives, until they end; stops them when it goes.
class Collector {
  public:
    explicit Collector(LiveSensors& sensors) : sensors_(sensors), thread_([this] { collect(); }) {}
    ~Collector() {
        sensors_.stop();
        join();
    }
    Collector(const Collector&) = delete;
    Collector& operator=(const Collector&) = delete;

    /// Waits for the end of the events.
    void join() {
        if (thread_.joinable()) {
            thread_.join();
        }
    }
    Bytes bytes() const {
        const std::lock_guard<std::mutex> lock(mutex_);
        return bytes_;
    }
    std::vector<EncodedImage> images() const {
        const std::lock_guard<std::mutex> lock(mutex_);
        return images_;
    }
    std::vector<double> arrivals() const {
        const std::lock_guard<std::mutex> lock(mutex_);
        return arrivals_;
    }
    std::vector<LidarBytes> lidar_events() const {
        const std::lock_guard<std::mutex> lock(mutex_);
        return lidar_events_;
    }

  private:
    void collect() {
        while (const auto event = sensors_.next()) {
            const std::lock_guard<std::mutex> lock(mutex_);
            arrivals_.push_back(arrival_of(*event));
            if (const auto* lidar = std::get_if<LidarBytes>(&*event)) {
                append(bytes_, lidar->bytes);
                lidar_events_.push_back(*lidar);
            } else {
                images_.push_back(std::get<CameraFrame>(*event).image);
            }
        }
    }

    LiveSensors& sensors_;
    mutable std::mutex mutex_;
    Bytes bytes_;
    std::vector<LidarBytes> lidar_events_;
    std::vector<EncodedImage> images_;
    std::vector<double> arrivals_;
    std::thread thread_;
};

/// Writes telegrams of the numbers 0, 2, ... and lets each few arrive before the next ones: a
/// terminal's buffer holds some 18, however long this machine is busy with something else.
inline bool send_telegrams(PseudoTerminal& terminal, const Collector& collector,
                           std::size_t count) {
    constexpr std::size_t kTogether = 8;
    for (std::size_t i = 0; i < count; ++i) {
        terminal.write(telegram_bytes(2 * static_cast<std::uint32_t>(i)));
        const std::size_t sent = i + 1;
        const auto arrived = [&] { return scan_numbers(collector.bytes()).size() >= sent; };
        if ((sent % kTogether == 0 || sent == count) && !comes_true(arrived)) {
            return false;
        }
    }
    return true;
}

}  // namespace hybrid_slam::test
