// SPDX-License-Identifier: Apache-2.0
#include "event_box.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

namespace hybrid_slam {

bool EventBox::push(LinkEvent event) {
    const bool is_pose = std::holds_alternative<LinkPose>(event.what);
    const bool is_farewell = std::holds_alternative<LinkDisconnected>(event.what);
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (events_.size() >= most_ && !make_room() && !is_farewell) {
            poses_dropped_ += is_pose ? 1 : 0;
            return is_pose;
        }
        events_.push_back(std::move(event));
    }
    came_.notify_one();
    return true;
}

/// The oldest pose goes: a newer one is worth more, and nothing else may be lost.
bool EventBox::make_room() {
    const auto oldest = std::find_if(events_.begin(), events_.end(), [](const LinkEvent& event) {
        return std::holds_alternative<LinkPose>(event.what);
    });
    if (oldest == events_.end()) {
        return false;
    }
    events_.erase(oldest);
    ++poses_dropped_;
    return true;
}

std::vector<LinkEvent> EventBox::take(double timeout) {
    std::unique_lock<std::mutex> lock(mutex_);
    if (timeout > 0.0) {
        came_.wait_for(lock, std::chrono::duration<double>(timeout),
                       [this] { return !events_.empty(); });
    }
    std::vector<LinkEvent> events(std::make_move_iterator(events_.begin()),
                                  std::make_move_iterator(events_.end()));
    events_.clear();
    return events;
}

std::uint64_t EventBox::poses_dropped() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return poses_dropped_;
}

}  // namespace hybrid_slam
