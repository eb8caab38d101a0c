// SPDX-License-Identifier: Apache-2.0
#include "incoming.hpp"

#include <cmath>

#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {
namespace {

/// Far more than any hall, and small enough for any arithmetic.
constexpr double kMostCoordinate = 1e6;
/// The standard's own bound, which is rounded up from pi.
constexpr double kMostTheta = 3.1415926536;

Json parse_json(std::string_view text) {
    if (text.size() > kMostMessageBytes) {
        throw FleetRefusal(kValidationError, "the message is longer than 262144 bytes");
    }
    Json json = Json::parse(text, nullptr, false);
    if (json.is_discarded()) {
        throw FleetRefusal(kValidationError, "the message is not JSON");
    }
    return json;
}

void check_header(const JsonReader& message, const FleetIdentity& us) {
    message.whole("headerId");
    message.text("timestamp");
    const std::string version = message.text("version");
    if (version.rfind("2.", 0) != 0) {
        message.fail("version", "only 2.x.y is spoken here");
    }
    if (message.text("manufacturer") != us.manufacturer) {
        message.fail("manufacturer", "is not " + us.manufacturer);
    }
    if (message.text("serialNumber") != us.serial_number) {
        message.fail("serialNumber", "is not " + us.serial_number);
    }
}

/// A message that cannot be read may still tell which it was.
References references_of(const Json& message) {
    References found;
    for (const char* key : {"headerId", "orderId", "orderUpdateId"}) {
        const auto member = message.is_object() ? message.find(key) : message.end();
        if (member == message.end()) {
            continue;
        }
        if (member->is_number_unsigned()) {
            found.emplace_back(key, std::to_string(member->get<std::uint64_t>()));
        }
        if (member->is_string() &&
            member->get_ref<const std::string&>().size() <= JsonReader::kMostText) {
            found.emplace_back(key, member->get<std::string>());
        }
    }
    return found;
}

FleetAction read_action(const JsonReader& reader) {
    FleetAction action{reader.text("actionId"), reader.text("actionType"), {}};
    const std::string blocking = reader.text("blockingType");
    if (blocking != "NONE" && blocking != "SOFT" && blocking != "HARD") {
        reader.fail("blockingType", "must be NONE, SOFT or HARD");
    }
    if (!reader.has("actionParameters")) {
        return action;
    }
    const Json& parameters = reader.array("actionParameters");
    for (std::size_t i = 0; i < parameters.size(); ++i) {
        const JsonReader parameter(parameters[i], reader.path("actionParameters", i));
        action.parameters.emplace_back(parameter.text("key"), parameter.value("value"));
    }
    return action;
}

std::vector<FleetAction> read_actions(const JsonReader& reader) {
    std::vector<FleetAction> actions;
    const Json& list = reader.array("actions");
    for (std::size_t i = 0; i < list.size(); ++i) {
        actions.push_back(read_action({list[i], reader.path("actions", i)}));
    }
    return actions;
}

double coordinate(const JsonReader& reader, const char* key) {
    const double value = reader.number(key);
    if (!(std::abs(value) <= kMostCoordinate)) {
        reader.fail(key, "must be within 1000 km");
    }
    return value;
}

std::optional<double> angle(const JsonReader& reader, const char* key) {
    const std::optional<double> value = reader.maybe_number(key);
    if (value && !(std::abs(*value) <= kMostTheta)) {
        reader.fail(key, "must be from -pi to pi");
    }
    return value;
}

std::optional<double> at_least_zero(const JsonReader& reader, const char* key) {
    const std::optional<double> value = reader.maybe_number(key);
    if (value && !(*value >= 0.0)) {
        reader.fail(key, "must not be negative");
    }
    return value;
}

NodePosition read_position(const JsonReader& reader) {
    NodePosition position;
    position.place = {coordinate(reader, "x"), coordinate(reader, "y")};
    position.theta = angle(reader, "theta");
    if (position.theta) {
        position.theta = normalize_angle(*position.theta);
    }
    position.deviation = at_least_zero(reader, "allowedDeviationXY");
    position.deviation_theta = angle(reader, "allowedDeviationTheta");
    position.map = reader.text("mapId");
    return position;
}

OrderNode read_node(const JsonReader& reader) {
    OrderNode node;
    node.id = reader.text("nodeId");
    node.sequence = reader.whole("sequenceId");
    node.is_released = reader.flag("released");
    if (reader.has("nodePosition")) {
        node.position = read_position({reader.value("nodePosition"), reader.path("nodePosition")});
    }
    node.actions = read_actions(reader);
    return node;
}

OrderEdge read_edge(const JsonReader& reader) {
    OrderEdge edge;
    edge.id = reader.text("edgeId");
    edge.sequence = reader.whole("sequenceId");
    edge.is_released = reader.flag("released");
    edge.start = reader.text("startNodeId");
    edge.end = reader.text("endNodeId");
    edge.most_speed = at_least_zero(reader, "maxSpeed");
    edge.most_height = at_least_zero(reader, "maxHeight");
    edge.least_height = at_least_zero(reader, "minHeight");
    edge.most_turn = at_least_zero(reader, "maxRotationSpeed");
    for (const char* hint : {"orientation", "direction", "trajectory", "corridor"}) {
        if (reader.has(hint)) {
            edge.hints.emplace_back(hint);
        }
    }
    if (reader.has("rotationAllowed") && !reader.flag("rotationAllowed")) {
        edge.hints.emplace_back("rotationAllowed");
    }
    edge.actions = read_actions(reader);
    return edge;
}

void check_edge(const Order& order, std::size_t index) {
    const OrderNode& from = order.nodes[index];
    const OrderNode& to = order.nodes[index + 1];
    const OrderEdge& edge = order.edges[index];
    const std::string name = "edges[" + std::to_string(index) + "]";
    const auto refuse = [&](const std::string& reason) {
        throw FleetRefusal(kValidationError, name + reason, {{"edgeId", edge.id}});
    };
    // In 64 bits, for a sequence may end at the greatest number.
    const std::uint64_t first = from.sequence;
    if (edge.sequence != first + 1 || to.sequence != first + 2) {
        refuse(": sequenceId must count up from node to edge to node");
    }
    if (edge.start != from.id || edge.end != to.id) {
        refuse(": startNodeId and endNodeId must be the nodes before and behind it");
    }
    if (to.is_released && !from.is_released) {
        refuse(": nothing released may follow what is not");
    }
    if (edge.is_released != to.is_released) {
        refuse(": must be released together with the node behind it");
    }
}

void check_chain(const Order& order) {
    if (order.nodes.empty()) {
        throw FleetRefusal(kValidationError, "nodes: must be one at least");
    }
    if (order.edges.size() + 1 != order.nodes.size()) {
        throw FleetRefusal(kValidationError, "edges: must be one less than nodes");
    }
    if (!order.nodes.front().is_released) {
        throw FleetRefusal(kValidationError, "nodes[0]: must be released");
    }
    for (std::size_t i = 0; i < order.edges.size(); ++i) {
        check_edge(order, i);
    }
}

Order read_order(const JsonReader& message) {
    Order order;
    order.id = message.text("orderId");
    order.update = message.whole("orderUpdateId");
    if (message.has("zoneSetId")) {
        order.zone_set = message.text("zoneSetId");
    }
    const Json& nodes = message.array("nodes");
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        order.nodes.push_back(read_node({nodes[i], message.path("nodes", i)}));
    }
    const Json& edges = message.array("edges");
    for (std::size_t i = 0; i < edges.size(); ++i) {
        order.edges.push_back(read_edge({edges[i], message.path("edges", i)}));
    }
    check_chain(order);
    return order;
}

/// `read` on the message's members; what it refuses gets the topic and the header's references.
template <typename Read>
auto read_message(std::string_view text, const char* topic, Read&& read) {
    Json json;
    try {
        json = parse_json(text);
        return read(JsonReader(json, ""));
    } catch (const FleetRefusal& refusal) {
        FleetRefusal told = refusal;
        References all = {{"topic", topic}};
        const References header = references_of(json);
        all.insert(all.end(), header.begin(), header.end());
        all.insert(all.end(), told.problem.references.begin(), told.problem.references.end());
        told.problem.references = std::move(all);
        throw told;
    }
}

}  // namespace

Order parse_order(std::string_view text, const FleetIdentity& us) {
    return read_message(text, "order", [&](const JsonReader& message) {
        check_header(message, us);
        Order order = read_order(message);
        if (order.id.empty()) {
            message.fail("orderId", "must not be empty");
        }
        return order;
    });
}

std::vector<FleetAction> parse_instant_actions(std::string_view text, const FleetIdentity& us) {
    return read_message(text, "instantActions", [&](const JsonReader& message) {
        check_header(message, us);
        return read_actions(message);
    });
}

}  // namespace hybrid_slam
