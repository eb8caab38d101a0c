// SPDX-License-Identifier: Apache-2.0
#include "event_queue.hpp"

#include <algorithm>
#include <utility>

namespace hybrid_slam {
namespace {

template <typename Event>
std::size_t push_bounded(std::deque<Event>& queue, Event event, std::size_t most) {
    std::size_t dropped = 0;
    while (!queue.empty() && queue.size() >= most) {
        queue.pop_front();
        ++dropped;
    }
    queue.push_back(std::move(event));
    return dropped;
}

template <typename Event>
SensorEvent take_first(std::deque<Event>& queue) {
    SensorEvent event = std::move(queue.front());
    queue.pop_front();
    return event;
}

}  // namespace

std::size_t EventQueue::push(LidarBytes bytes) {
    return push_bounded(lidar_, std::move(bytes), most_lidar_events_);
}

std::size_t EventQueue::push(CameraFrame frame) {
    return push_bounded(images_, std::move(frame), most_images_);
}

std::optional<SensorEvent> EventQueue::pop() {
    if (empty()) {
        return std::nullopt;
    }
    const bool lidar_first =
        images_.empty() || (!lidar_.empty() && lidar_.front().arrival <= images_.front().arrival);
    SensorEvent event = lidar_first ? take_first(lidar_) : take_first(images_);
    // A thread may be held up between taking the time and handing over, by microseconds mostly;
    // then the other one's later event is out already.
    std::visit(
        [this](auto& what) {
            if (any_taken_) {
                what.arrival = std::max(what.arrival, last_arrival_);
            }
            last_arrival_ = what.arrival;
        },
        event);
    any_taken_ = true;
    return event;
}

}  // namespace hybrid_slam
