// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <vector>

#include "hybrid_slam/link/link_server.hpp"

namespace hybrid_slam {

/// Events from the server's thread to its owner. Never holds more than `most` and the farewells of
/// the clients that were let in.
class EventBox {
  public:
    explicit EventBox(std::size_t most) : most_(most) {}

    /// False when it is full: the client must be told that nobody listens.
    bool push(LinkEvent event);
    std::vector<LinkEvent> take(double timeout);
    std::uint64_t poses_dropped() const;

  private:
    bool make_room();

    std::size_t most_;
    mutable std::mutex mutex_;
    std::condition_variable came_;
    std::deque<LinkEvent> events_;
    std::uint64_t poses_dropped_ = 0;
};

}  // namespace hybrid_slam
