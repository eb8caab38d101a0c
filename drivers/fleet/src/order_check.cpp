// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "order_book.hpp"

namespace hybrid_slam {
namespace {

void refuse_actions(const std::vector<FleetAction>& actions, const char* key,
                    const std::string& id) {
    if (!actions.empty()) {
        throw FleetRefusal(
            kOrderError, "action not supported: this vehicle drives, and does nothing on the way",
            {{key, id}, {"actionId", actions.front().id}, {"actionType", actions.front().type}});
    }
}

void check_node(const OrderNode& node) {
    refuse_actions(node.actions, "nodeId", node.id);
    if (!node.position) {
        throw FleetRefusal(kOrderError, "nodePosition is needed: the way is planned here",
                           {{"nodeId", node.id}});
    }
}

void check_edge(const OrderEdge& edge, const FleetVehicle& vehicle) {
    const auto refuse = [&edge](const char* member, const std::string& reason) {
        throw FleetRefusal(kOrderError, std::string(member) + ": " + reason,
                           {{"edgeId", edge.id}, {"edge." + std::string(member), edge.id}});
    };
    refuse_actions(edge.actions, "edgeId", edge.id);
    // There is one speed limit for the whole way, so that a lower one cannot be kept.
    if (edge.most_speed && *edge.most_speed < vehicle.speed_most) {
        refuse("maxSpeed", "is less than the vehicle's speed limit");
    }
    if (edge.most_height && *edge.most_height < vehicle.height) {
        refuse("maxHeight", "is less than the vehicle's height");
    }
    if (edge.least_height && *edge.least_height > 0.0) {
        refuse("minHeight", "the forks cannot be lifted from here");
    }
}

void check_hints(const OrderEdge& edge) {
    const std::string hint = !edge.hints.empty() ? edge.hints.front()
                             : edge.most_turn    ? "maxRotationSpeed"
                                                 : "";
    if (!hint.empty()) {
        throw FleetRefusal(kOrderError, hint + ": not supported, for the vehicle plans its own way",
                           {{"edgeId", edge.id}, {"edge." + hint, edge.id}});
    }
}

}  // namespace

void check_feasible(const Order& order, const FleetConfig& config, const FleetVehicle& vehicle) {
    if (!order.zone_set.empty()) {
        throw FleetRefusal(kOrderError, "zoneSetId: there are no zones here",
                           {{"zoneSetId", order.zone_set}});
    }
    for (const OrderNode& node : order.nodes) {
        check_node(node);
    }
    for (const OrderEdge& edge : order.edges) {
        check_edge(edge, vehicle);
        if (!config.ignore_edge_hints) {
            check_hints(edge);
        }
    }
}

void check_map(const Order& order, const OrderScene& scene) {
    for (const OrderNode& node : order.nodes) {
        if (node.position->map != scene.map) {
            throw FleetRefusal(kOrderError, "mapId: the vehicle is in the map '" + scene.map + "'",
                               {{"nodeId", node.id}, {"mapId", node.position->map}});
        }
    }
}

/// "Trivially reachable": the vehicle stands on the first node or within its deviation.
void OrderBook::check_start(const OrderNode& node, const OrderScene& scene) const {
    const References where = {{"nodeId", node.id}};
    if (!scene.map_from_robot) {
        throw FleetRefusal(kNoRouteError, "the vehicle does not know where it is", where);
    }
    const NodePosition& position = *node.position;
    // 0 and nothing mean the vehicle's own tolerance.
    const double reach =
        position.deviation.value_or(0.0) > 0.0 ? *position.deviation : config_.start_distance;
    if ((scene.map_from_robot->translation - position.place).norm() > reach) {
        throw FleetRefusal(kNoRouteError, "the vehicle does not stand on the first node", where);
    }
    const double allowed = std::abs(position.deviation_theta.value_or(0.0));
    const double turn = allowed > 0.0 ? allowed : config_.start_heading;
    if (position.theta &&
        std::abs(normalize_angle(scene.map_from_robot->heading - *position.theta)) > turn) {
        throw FleetRefusal(kNoRouteError, "the vehicle does not head as the first node wants",
                           where);
    }
}

void OrderBook::check_new(const Order& order, const OrderScene& scene) const {
    if (is_active()) {
        throw FleetRefusal(kOrderError, "the vehicle still carries out another order",
                           {{"orderId", order_id_}});
    }
    check_feasible(order, config_, vehicle_);
    check_map(order, scene);
    check_start(order.nodes.front(), scene);
}

void OrderBook::check_update(const Order& order) const {
    if (order.update < update_) {
        throw FleetRefusal(kOrderUpdateError, "a later update is there already");
    }
    if (has_ended_early_) {
        throw FleetRefusal(kOrderUpdateError, "the order was cancelled, so send a new one");
    }
    const OrderNode& first = order.nodes.front();
    const bool joins_base = first.id == base_end_ && first.sequence == base_end_sequence_;
    const bool joins_place =
        is_active() || (first.id == last_node_ && first.sequence == last_sequence_);
    if (!joins_base || !joins_place) {
        throw FleetRefusal(kOrderUpdateError,
                           "the first node is not the last released one, " + base_end_,
                           {{"nodeId", first.id}});
    }
}

}  // namespace hybrid_slam
