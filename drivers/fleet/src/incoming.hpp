// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "json_reader.hpp"

namespace hybrid_slam {

inline constexpr std::size_t kMostMessageBytes = 262144;

/// Who we are in the headers.
struct FleetIdentity {
    std::string manufacturer;
    std::string serial_number;
};

struct FleetAction {
    std::string id;
    std::string type;
    std::vector<std::pair<std::string, Json>> parameters;
};

struct NodePosition {
    Eigen::Vector2d place = Eigen::Vector2d::Zero();
    std::optional<double> theta;
    std::optional<double> deviation;        ///< m
    std::optional<double> deviation_theta;  ///< rad
    std::string map;
};

struct OrderNode {
    std::string id;
    std::uint32_t sequence = 0;
    bool is_released = false;
    std::optional<NodePosition> position;
    std::vector<FleetAction> actions;
};

struct OrderEdge {
    std::string id;
    std::uint32_t sequence = 0;
    bool is_released = false;
    std::string start;
    std::string end;
    std::optional<double> most_speed;
    std::optional<double> most_height;
    std::optional<double> least_height;
    std::optional<double> most_turn;  ///< rad/s
    std::vector<std::string> hints;   ///< members that say how to drive, which we plan ourselves
    std::vector<FleetAction> actions;
};

struct Order {
    std::string id;
    std::uint32_t update = 0;
    std::string zone_set;
    std::vector<OrderNode> nodes;  ///< one at least
    std::vector<OrderEdge> edges;  ///< one less

    References references() const {
        return {{"orderId", id}, {"orderUpdateId", std::to_string(update)}};
    }
};

/// Throws FleetRefusal for all that is no good message for us, with the ids of its header in the
/// references as far as these could be read. A good order is a chain: sequence ids count up, edges
/// join their neighbours, and the released part comes first.
Order parse_order(std::string_view text, const FleetIdentity& us);
std::vector<FleetAction> parse_instant_actions(std::string_view text, const FleetIdentity& us);

}  // namespace hybrid_slam
