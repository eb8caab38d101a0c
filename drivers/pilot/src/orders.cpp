// SPDX-License-Identifier: Apache-2.0
#include "orders.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace hybrid_slam {

std::vector<Waypoint> Order::ahead() const {
    const std::size_t passed = std::min(reached, waypoints.size());
    return {waypoints.begin() + static_cast<std::ptrdiff_t>(passed), waypoints.end()};
}

void Orders::add(const LinkGoals& goals, std::uint64_t client) {
    if (!goals.append) {
        abandon();
    }
    Order order;
    order.client = client;
    for (const LinkWaypoint& each : goals.waypoints) {
        order.waypoints.push_back({each.place, each.heading});
    }
    waiting_.push_back(std::move(order));
}

void Orders::abandon() {
    waiting_.clear();
    dropping_ = active_.has_value();
}

void Orders::drop() {
    dropping_ = false;
    active_.reset();
}

void Orders::begin() {
    if (!active_ && !waiting_.empty()) {
        active_ = std::move(waiting_.front());
        waiting_.pop_front();
    }
}

bool Orders::are_of(std::uint64_t client) const {
    return (active_ && active_->client == client) ||
           std::any_of(waiting_.begin(), waiting_.end(),
                       [client](const Order& order) { return order.client == client; });
}

std::size_t Orders::waypoints_left() const {
    std::size_t left = active_ && !dropping_ ? active_->ahead().size() : 0;
    for (const Order& order : waiting_) {
        left += order.waypoints.size();
    }
    return left;
}

std::string why_no_way(const Route& route, const std::vector<Waypoint>& waypoints) {
    const auto place = [&] {
        const Point2& at = waypoints.at(route.failed_waypoint).position;
        return fmt::format("waypoint {} ({:.2f}, {:.2f})", route.failed_waypoint + 1, at.x(),
                           at.y());
    };
    switch (route.status) {
        case PlanStatus::kStartBlocked:
            return "by the map the vehicle touches something where it stands";
        case PlanStatus::kGoalBlocked:
            return place() + ": by the map the vehicle has no room there";
        case PlanStatus::kUnfinished:
            return place() + ": the search for a way was given up (planner.max_nodes)";
        case PlanStatus::kNoWay:
        case PlanStatus::kFound:
            break;
    }
    return place() + ": there is no way to it";
}

}  // namespace hybrid_slam
