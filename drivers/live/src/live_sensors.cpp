// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/live/live_sensors.hpp"

#include <future>
#include <thread>
#include <vector>

#include "live_state.hpp"

namespace hybrid_slam {
namespace {

/// A thread that is waited for at the end, but not for ever: V4L2 and name servers can keep one for
/// ten seconds. It owns a share of all that it uses.
class Worker {
  public:
    Worker(std::shared_ptr<LiveState> state, void (*run)(LiveState&)) {
        std::packaged_task<void()> task([state = std::move(state), run] { run(*state); });
        done_ = task.get_future();
        thread_ = std::thread(std::move(task));
    }
    ~Worker() {
        if (!thread_.joinable()) {
            return;
        }
        if (done_.wait_for(kPatience) == std::future_status::ready) {
            thread_.join();
        } else {
            thread_.detach();
        }
    }
    Worker(Worker&&) = default;
    Worker& operator=(Worker&&) = delete;

  private:
    static constexpr std::chrono::milliseconds kPatience{400};

    std::future<void> done_;
    std::thread thread_;
};

}  // namespace

std::string_view to_string(DeviceState state) {
    switch (state) {
        case DeviceState::kOff:
            return "off";
        case DeviceState::kConnecting:
            return "connecting";
        case DeviceState::kStreaming:
            return "streaming";
        case DeviceState::kSilent:
            return "silent";
        case DeviceState::kUnreadable:
            return "unreadable";
    }
    return "unknown";
}

struct LiveSensors::State {
    std::shared_ptr<LiveState> shared;
    std::vector<Worker> workers;
};

LiveSensors::LiveSensors(const RobotConfig& robot, LiveOptions options)
    : state_(std::make_unique<State>()) {
    state_->shared = std::make_shared<LiveState>(robot, std::move(options));
    state_->workers.emplace_back(state_->shared, &run_lidar);
    if (robot.camera.enabled) {
        state_->workers.emplace_back(state_->shared, &run_camera);
    }
}

LiveSensors::~LiveSensors() {
    stop();
}

std::optional<SensorEvent> LiveSensors::next() {
    return state_->shared->pop(std::nullopt);
}

std::optional<SensorEvent> LiveSensors::next_within(double timeout) {
    return state_->shared->pop(timeout);
}

bool LiveSensors::ended() const {
    return state_->shared->over();
}

void LiveSensors::stop() {
    state_->shared->stop();
}

LiveStatus LiveSensors::status() const {
    return state_->shared->status();
}

double LiveSensors::now() const {
    return state_->shared->options.now();
}

}  // namespace hybrid_slam
