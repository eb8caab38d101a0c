// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <deque>
#include <optional>
#include <string>
#include <thread>

#include "hybrid_slam/link/link_server.hpp"
#include "raw_socket.hpp"

namespace hybrid_slam::test {

inline LinkServerConfig any_port() {
    LinkServerConfig config;
    config.listen = ":0";
    return config;
}

/// Takes the events of a server one by one.
class Events {
  public:
    explicit Events(LinkServer& server) : server_(server) {}

    /// Nothing when none comes for long.
    std::optional<LinkEvent> next() {
        if (waiting_.empty()) {
            for (LinkEvent& event : server_.events(kLongWait)) {
                waiting_.push_back(std::move(event));
            }
        }
        if (waiting_.empty()) {
            return std::nullopt;
        }
        LinkEvent event = std::move(waiting_.front());
        waiting_.pop_front();
        return event;
    }

    /// The next one of a kind, others are skipped.
    template <typename What>
    std::optional<What> next_of() {
        while (std::optional<LinkEvent> event = next()) {
            if (const What* const what = std::get_if<What>(&event->what)) {
                return *what;
            }
        }
        return std::nullopt;
    }

  private:
    LinkServer& server_;
    std::deque<LinkEvent> waiting_;
};

/// Looks until it is so, for long at most.
template <typename Condition>
bool eventually(Condition&& condition) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(kLongWait);
    while (!condition()) {
        if (std::chrono::steady_clock::now() > until) {
            return false;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return true;
}

}  // namespace hybrid_slam::test
