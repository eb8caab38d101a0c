// SPDX-License-Identifier: Apache-2.0
#include "order_book.hpp"

#include <algorithm>

namespace hybrid_slam {

std::optional<LinkGoals> OrderBook::take(const Order& order, const OrderScene& scene) {
    try {
        if (scene.mode == LinkMode::kManual) {
            throw FleetRefusal(kOrderError, "the vehicle is driven by hand");
        }
        const bool is_update = order.id == order_id_;
        if (is_update) {
            check_update(order);
            // The stitching node is the one that is known; what the update says of it is not read.
            Order rest = order;
            rest.nodes.erase(rest.nodes.begin());
            check_feasible(rest, config_, vehicle_);
            check_map(rest, scene);
        } else {
            check_new(order, scene);
            begin(order);
        }
        goals_before_ = scene.goals;
        is_taken_ = false;
        return extend(order, is_update);
    } catch (FleetRefusal& refusal) {
        References& all = refusal.problem.references;
        const References ids = order.references();
        all.insert(all.begin(), ids.begin(), ids.end());
        throw;
    }
}

void OrderBook::begin(const Order& order) {
    order_id_ = order.id;
    has_ended_early_ = false;
    last_node_ = order.nodes.front().id;
    last_sequence_ = order.nodes.front().sequence;
    sent_.clear();
    passed_ = 0;
}

/// Behind the base comes what the order says; a horizon that was there is forgotten.
std::optional<LinkGoals> OrderBook::extend(const Order& order, bool is_update) {
    update_ = order.update;
    const auto base = static_cast<std::size_t>(released_left());
    nodes_.resize(base);
    edges_.resize(base);
    nodes_.insert(nodes_.end(), order.nodes.begin() + 1, order.nodes.end());
    edges_.insert(edges_.end(), order.edges.begin(), order.edges.end());
    base_end_ = order.nodes.front().id;
    base_end_sequence_ = order.nodes.front().sequence;
    LinkGoals goals{{}, is_update, order.id + ":" + std::to_string(order.update)};
    for (std::size_t i = 1; i < order.nodes.size() && order.nodes[i].is_released; ++i) {
        const OrderNode& node = order.nodes[i];
        goals.waypoints.push_back({node.position->place, node.position->theta});
        base_end_ = node.id;
        base_end_sequence_ = node.sequence;
    }
    if (goals.waypoints.empty()) {
        return std::nullopt;
    }
    const int before = sent_.empty() ? passed_ : sent_.back().total;
    sent_.push_back({goals.id, before + static_cast<int>(goals.waypoints.size())});
    return goals;
}

int OrderBook::released_left() const {
    return static_cast<int>(std::count_if(nodes_.begin(), nodes_.end(),
                                          [](const OrderNode& node) { return node.is_released; }));
}

bool OrderBook::wants_base() const {
    return is_active() && !nodes_.back().is_released && released_left() <= 1;
}

std::string OrderBook::follow(const LinkStatus& status) {
    if (released_left() == 0) {
        return {};
    }
    const auto known = std::find_if(sent_.begin(), sent_.end(), [&status](const Sent& sent) {
        return sent.id == status.goals;
    });
    if (known == sent_.end()) {
        const bool is_ours = !is_taken_ && status.goals == goals_before_;
        return is_ours ? "" : "other goals took the order's place";
    }
    sent_.erase(sent_.begin(), known);
    is_taken_ = true;
    // None left is not yet arrived: a goal may also have been given up.
    if (status.waypoints_left > 0 || status.state == LinkDriveState::kArrived) {
        const int total = sent_.front().total;
        const int passed = std::min(total, total - status.waypoints_left);
        for (; passed_ < passed; ++passed_) {
            pass_node();
        }
        return {};
    }
    const bool is_given_up = status.state == LinkDriveState::kIdle && sent_.size() == 1;
    return is_given_up ? "the drive gave the goals up: " + status.reason : "";
}

void OrderBook::pass_node() {
    last_node_ = nodes_.front().id;
    last_sequence_ = nodes_.front().sequence;
    nodes_.pop_front();
    edges_.pop_front();
}

void OrderBook::end() {
    has_ended_early_ = is_active();
    nodes_.clear();
    edges_.clear();
}

}  // namespace hybrid_slam
