// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "hybrid_slam/link/messages.hpp"
#include "hybrid_slam/vehicle/planner.hpp"

namespace hybrid_slam {

/// Places that somebody sent together.
struct Order {
    std::vector<Waypoint> waypoints;
    std::uint64_t client = 0;
    std::size_t reached = 0;  ///< waypoints, before the present route
    int replans = 0;

    std::vector<Waypoint> ahead() const;  ///< of the waypoints those not reached
};

/// What the vehicle was asked to do: the order that it is at, and those that wait.
class Orders {
  public:
    /// Behind the others, or instead of them.
    void add(const LinkGoals& goals, std::uint64_t client);

    /// All of them end; the one that it is at as soon as `drop` says so.
    void abandon();
    bool dropping() const { return dropping_; }
    void drop();

    /// Begins with the first that waits, unless it is at one.
    void begin();
    void finish() { active_.reset(); }
    /// The one that it is at: planned for, or driven.
    Order* active() { return active_ ? &*active_ : nullptr; }

    bool empty() const { return !active_ && waiting_.empty(); }
    bool are_of(std::uint64_t client) const;  ///< any of them
    /// Waypoints that it will still be driven to.
    std::size_t waypoints_left() const;

  private:
    std::deque<Order> waiting_;
    std::optional<Order> active_;
    bool dropping_ = false;
};

/// What a search for a way through the waypoints says that found none.
std::string why_no_way(const Route& route, const std::vector<Waypoint>& waypoints);

}  // namespace hybrid_slam
