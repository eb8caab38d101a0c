// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "hybrid_slam/fleet/fleet_config.hpp"
#include "hybrid_slam/fleet/fleet_messages.hpp"
#include "incoming.hpp"

namespace hybrid_slam {

/// Whether this vehicle can do an order at all. Throws FleetRefusal (orderError) with the wrong
/// members as references.
void check_feasible(const Order& order, const FleetConfig& config, const FleetVehicle& vehicle);

/// Where an order meets the vehicle.
struct OrderScene {
    LinkMode mode = LinkMode::kManual;
    std::string map;
    std::optional<Pose2d> map_from_robot;  ///< nothing: not known now
    std::string goals;                     ///< LinkStatus::goals
};

/// Throws FleetRefusal (orderError) for a node in another map.
void check_map(const Order& order, const OrderScene& scene);

/// The order that the vehicle holds: what is left of it, and how far the drive is.
class OrderBook {
  public:
    OrderBook(const FleetConfig& config, const FleetVehicle& vehicle)
        : config_(config), vehicle_(vehicle) {}

    /// The same order and update again, which is not an error.
    bool has(const Order& order) const { return order.id == order_id_ && order.update == update_; }

    /// Takes a new order or an update of the one that is held; what is to be driven for it now, if
    /// anything. Throws FleetRefusal, and then nothing has changed.
    std::optional<LinkGoals> take(const Order& order, const OrderScene& scene);

    /// Passes the nodes that the drive has passed. Returns why the order ended without us, as by
    /// another client's goals; empty: it did not.
    std::string follow(const LinkStatus& status);

    /// The rest is not driven, and no update can bring it back; its id stays.
    void end();

    /// Not done: nodes are left, be it in the horizon alone.
    bool is_active() const { return !nodes_.empty(); }
    /// The released part runs out while more was announced.
    bool wants_base() const;

    /// The vehicle was put somewhere else.
    void set_last_node(const std::string& id) {
        last_node_ = id;
        last_sequence_ = 0;
    }

    const std::string& order_id() const { return order_id_; }
    std::uint32_t update() const { return update_; }
    const std::string& last_node() const { return last_node_; }
    std::uint32_t last_sequence() const { return last_sequence_; }
    const std::deque<OrderNode>& nodes() const { return nodes_; }
    const std::deque<OrderEdge>& edges() const { return edges_; }

  private:
    struct Sent {
        std::string id;
        int total;  ///< waypoints of this order up to these
    };

    void check_new(const Order& order, const OrderScene& scene) const;
    void check_update(const Order& order) const;
    void check_start(const OrderNode& node, const OrderScene& scene) const;
    void begin(const Order& order);
    std::optional<LinkGoals> extend(const Order& order, bool is_update);
    void pass_node();
    int released_left() const;

    const FleetConfig& config_;
    const FleetVehicle& vehicle_;
    std::string order_id_;
    std::uint32_t update_ = 0;
    std::string last_node_;
    std::uint32_t last_sequence_ = 0;
    std::string base_end_;  ///< the last released node, at which an update must begin
    std::uint32_t base_end_sequence_ = 0;
    bool has_ended_early_ = false;
    std::deque<OrderNode> nodes_;  ///< not passed yet
    std::deque<OrderEdge> edges_;  ///< each before the node of its index
    std::deque<Sent> sent_;        ///< from the last that the drive has taken on
    int passed_ = 0;
    bool is_taken_ = false;     ///< the drive has told one of our ids since the last goals
    std::string goals_before_;  ///< what it told before
};

}  // namespace hybrid_slam
