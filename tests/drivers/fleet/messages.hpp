// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

/// What a master control sends, in JSON that a test may spoil.
namespace hybrid_slam::test {

using Json = nlohmann::json;

inline Json header() {
    return {{"headerId", 7},
            {"timestamp", "2026-01-01T12:00:00.00Z"},
            {"version", "2.1.0"},
            {"manufacturer", "ExampleCo"},
            {"serialNumber", "FL-0001"}};
}

/// Node i stands at x = i in the map "hall" and is called n<i>.
inline Json node(std::uint32_t index, bool is_released) {
    return {{"nodeId", "n" + std::to_string(index)},
            {"sequenceId", 2 * index},
            {"released", is_released},
            {"nodePosition", {{"x", 1.0 * index}, {"y", 0.0}, {"mapId", "hall"}}},
            {"actions", Json::array()}};
}

inline Json edge(std::uint32_t index, bool is_released) {
    return {{"edgeId", "e" + std::to_string(index)},
            {"sequenceId", 2 * index + 1},
            {"released", is_released},
            {"startNodeId", "n" + std::to_string(index)},
            {"endNodeId", "n" + std::to_string(index + 1)},
            {"actions", Json::array()}};
}

/// Nodes from `first` on, of which the first `base` are released and `horizon` more are not.
inline Json order(const std::string& id, std::uint32_t update, std::uint32_t first,
                  std::uint32_t base, std::uint32_t horizon = 0) {
    Json message = header();
    message["orderId"] = id;
    message["orderUpdateId"] = update;
    message["nodes"] = Json::array();
    message["edges"] = Json::array();
    for (std::uint32_t i = 0; i < base + horizon; ++i) {
        message["nodes"].push_back(node(first + i, i < base));
        if (i > 0) {
            message["edges"].push_back(edge(first + i - 1, i < base));
        }
    }
    return message;
}

inline Json action(const std::string& id, const std::string& type) {
    return {{"actionId", id}, {"actionType", type}, {"blockingType", "NONE"}};
}

inline Json init_position(const std::string& id, double x, double y, double theta) {
    Json message = action(id, "initPosition");
    const auto add = [&message](const char* key, const Json& value) {
        message["actionParameters"].push_back({{"key", key}, {"value", value}});
    };
    add("x", x);
    add("y", y);
    add("theta", theta);
    add("mapId", "hall");
    add("lastNodeId", "dock");
    return message;
}

inline Json instant(const Json& actions) {
    Json message = header();
    message["actions"] = actions.is_array() ? actions : Json::array({actions});
    return message;
}

}  // namespace hybrid_slam::test
