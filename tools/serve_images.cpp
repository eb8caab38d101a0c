// SPDX-License-Identifier: Apache-2.0
#include "serve_images.hpp"

#include <chrono>
#include <utility>

namespace hybrid_slam::tools {

ServeImages::ServeImages(std::unique_ptr<MomentRenderer> renderer, ServeDevices& devices,
                         const RealTime& clock)
    : renderer_(std::move(renderer)),
      devices_(devices),
      clock_(clock),
      thread_([this] { run(); }) {}

ServeImages::~ServeImages() {
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

void ServeImages::push(CameraMoment moment) {
    constexpr std::size_t kMostWaiting = 2;
    if (!devices_.camera_is_watched()) {
        return;
    }
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (moments_.size() == kMostWaiting) {
            moments_.pop_front();
            ++dropped_;
        }
        moments_.push_back(std::move(moment));
    }
    changed_.notify_all();
}

std::uint64_t ServeImages::sent() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return sent_;
}

std::uint64_t ServeImages::dropped() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return dropped_;
}

/// False when it is to stop.
bool ServeImages::wait_until(double simulated) {
    const std::chrono::duration<double> left(simulated - clock_.seconds());
    std::unique_lock<std::mutex> lock(mutex_);
    return !changed_.wait_for(lock, left, [this] { return stop_; });
}

void ServeImages::run() {
    for (;;) {
        CameraMoment moment;
        {
            std::unique_lock<std::mutex> lock(mutex_);
            changed_.wait(lock, [this] { return stop_ || !moments_.empty(); });
            if (stop_) {
                return;
            }
            moment = std::move(moments_.front());
            moments_.pop_front();
        }
        EncodedImage image = renderer_->render(moment);
        if (!wait_until(moment.arrival)) {
            return;
        }
        {
            // Before it goes out: whoever has it can count on it.
            const std::lock_guard<std::mutex> lock(mutex_);
            ++sent_;
        }
        devices_.publish(std::move(image));
    }
}

}  // namespace hybrid_slam::tools
