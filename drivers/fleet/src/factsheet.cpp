// SPDX-License-Identifier: Apache-2.0
#include "action_states.hpp"
#include "fleet_limits.hpp"
#include "incoming.hpp"
#include "outgoing.hpp"

namespace hybrid_slam {
namespace {

Json type_json(const FleetVehicle& vehicle) {
    return {{"seriesName", vehicle.series},     {"agvKinematic", "THREEWHEEL"},
            {"agvClass", "FORKLIFT"},           {"maxLoadMass", vehicle.load_mass},
            {"localizationTypes", {"NATURAL"}}, {"navigationTypes", {"AUTONOMOUS"}}};
}

Json physical_json(const FleetVehicle& vehicle) {
    return {{"speedMin", vehicle.speed_least},
            {"speedMax", vehicle.speed_most},
            {"accelerationMax", vehicle.acceleration},
            {"decelerationMax", vehicle.deceleration},
            {"heightMin", vehicle.height},
            {"heightMax", vehicle.height},
            {"width", vehicle.width},
            {"length", vehicle.length}};
}

Json limits_json(const FleetConfig& config) {
    Json timing = {{"minOrderInterval", kLeastStateInterval},
                   {"minStateInterval", kLeastStateInterval},
                   {"defaultStateInterval", config.state_period}};
    if (config.visualization_period > 0.0) {
        timing["visualizationInterval"] = config.visualization_period;
    }
    const auto items = JsonReader::kMostItems;
    return {{"maxStringLens",
             {{"msgLen", kMostMessageBytes},
              {"topicSerialLen", JsonReader::kMostText},
              {"topicElemLen", JsonReader::kMostText},
              {"idLen", JsonReader::kMostText},
              {"idNumericalOnly", false},
              {"enumLen", JsonReader::kMostText}}},
            {"maxArrayLens",
             {{"order.nodes", items},
              {"order.edges", items - 1},
              {"instantActions", items},
              {"state.actionStates", ActionStates::kMost},
              {"state.errors", kMostProblems + 3}}},
            {"timing", std::move(timing)}};
}

Json parameter_json(const char* key, const char* type) {
    return {{"key", key}, {"valueDataType", type}};
}

/// The schema's blockingTypes cannot be met by any array, so that they are not told.
Json action_json(const char* type, const char* text) {
    return {{"actionType", type}, {"actionDescription", text}, {"actionScopes", {"INSTANT"}}};
}

Json features_json(const FleetConfig& config) {
    Json optional =
        Json::array({{{"parameter", "order.nodes.nodePosition"},
                      {"support", "REQUIRED"},
                      {"description", "the vehicle plans its own way"}},
                     {{"parameter", "order.nodes.nodePosition.theta"}, {"support", "SUPPORTED"}}});
    if (config.ignore_edge_hints) {
        optional.push_back({{"parameter", "order.edges.trajectory"},
                            {"support", "SUPPORTED"},
                            {"description", "taken, but not followed"}});
    }
    Json init = action_json("initPosition", "where to look for the position");
    init["actionParameters"] =
        Json::array({parameter_json("x", "FLOAT"), parameter_json("y", "FLOAT"),
                     parameter_json("theta", "FLOAT"), parameter_json("mapId", "STRING"),
                     parameter_json("lastNodeId", "STRING")});
    Json actions = Json::array({action_json("startPause", "stop, and keep the order"),
                                action_json("stopPause", "drive on"),
                                action_json("cancelOrder", "stop, and forget the order"),
                                action_json("stateRequest", "a state at once"),
                                action_json("factsheetRequest", "this sheet at once")});
    actions.push_back(std::move(init));
    return {{"optionalParameters", std::move(optional)}, {"agvActions", std::move(actions)}};
}

Json geometry_json(const FleetVehicle& vehicle) {
    Json geometry = Json::object();
    if (vehicle.footprint.empty()) {
        return geometry;
    }
    Json corners = Json::array();
    for (const Eigen::Vector2d& corner : vehicle.footprint) {
        corners.push_back({{"x", corner.x()}, {"y", corner.y()}});
    }
    geometry["envelopes2d"] =
        Json::array({{{"set", "default"}, {"polygonPoints", std::move(corners)}}});
    return geometry;
}

}  // namespace

Json factsheet_body(const FleetConfig& config, const FleetVehicle& vehicle) {
    return {
        {"typeSpecification", type_json(vehicle)}, {"physicalParameters", physical_json(vehicle)},
        {"protocolLimits", limits_json(config)},   {"protocolFeatures", features_json(config)},
        {"agvGeometry", geometry_json(vehicle)},   {"loadSpecification", Json::object()}};
}

}  // namespace hybrid_slam
