// SPDX-License-Identifier: Apache-2.0
#include "live_state.hpp"

#include <chrono>

#include "hybrid_slam/core/stopwatch.hpp"

namespace hybrid_slam {
namespace {

/// What was not given, filled in.
LiveOptions completed(LiveOptions options) {
    if (!options.now) {
        const auto wall = std::chrono::system_clock::now().time_since_epoch();
        const double ahead = std::chrono::duration<double>(wall).count() - steady_seconds();
        options.now = [ahead] { return ahead + steady_seconds(); };
    }
    return options;
}

}  // namespace

LiveState::LiveState(const RobotConfig& robot_config, LiveOptions live_options)
    : robot(robot_config),
      options(completed(std::move(live_options))),
      queue_(options.most_lidar_events, options.most_images) {
    status_.lidar.state = DeviceState::kConnecting;
    status_.lidar.detail = robot.lidar.port + ": connecting";
    if (robot.camera.enabled) {
        status_.camera.state = DeviceState::kConnecting;
        status_.camera.detail = robot.camera.device + ": connecting";
    }
}

void LiveState::stop() {
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        stopped_ = true;
    }
    changed_.notify_all();
    stop_told_.notify_all();
}

bool LiveState::stopping() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return stopped_ || lidar_ended_;
}

bool LiveState::wait_for_stop(double seconds) {
    std::unique_lock<std::mutex> lock(mutex_);
    return stop_told_.wait_for(lock, std::chrono::duration<double>(seconds),
                               [this] { return stopped_ || lidar_ended_; });
}

void LiveState::lidar_opened() {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++status_.lidar.connects;
}

void LiveState::set_lidar(DeviceState state, const std::string& detail) {
    const std::lock_guard<std::mutex> lock(mutex_);
    status_.lidar.state = state;
    status_.lidar.detail = detail;
}

void LiveState::end_lidar() {
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        status_.lidar.state = DeviceState::kOff;
        status_.lidar.detail = robot.lidar.port + ": ended";
        lidar_ended_ = true;
    }
    changed_.notify_all();
    stop_told_.notify_all();
}

void LiveState::camera_opened() {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++status_.camera.connects;
}

void LiveState::camera_streams() {
    const std::lock_guard<std::mutex> lock(mutex_);
    status_.camera.state = DeviceState::kStreaming;
    status_.camera.detail.clear();
    status_.lidar_only = false;
}

void LiveState::camera_lost(DeviceState state, const std::string& what) {
    const std::lock_guard<std::mutex> lock(mutex_);
    status_.camera.state = state;
    status_.camera.detail = what + "; going on with the lidar alone";
    status_.lidar_only = true;
}

std::optional<SensorEvent> LiveState::pop(std::optional<double> timeout) {
    std::unique_lock<std::mutex> lock(mutex_);
    const auto ready = [this] { return is_over() || !queue_.empty(); };
    if (timeout) {
        changed_.wait_for(lock, std::chrono::duration<double>(*timeout), ready);
    } else {
        changed_.wait(lock, ready);
    }
    return stopped_ ? std::nullopt : queue_.pop();
}

bool LiveState::over() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return is_over();
}

LiveStatus LiveState::status() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return status_;
}

}  // namespace hybrid_slam
