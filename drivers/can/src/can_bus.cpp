// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/can/can_bus.hpp"

#include "can_buses.hpp"
#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {

void describe(ConfigSchema& schema, CanConfig& config) {
    schema.add("port", config.port, "can0, slcan:/dev/ttyACM0 or candump:FILE for a dry run");
    schema.add("bit_rate", config.bit_rate, 10000, 1000000,
               "of the bus, for slcan; that of can0 is set by ip link");
    schema.add("baud", config.baud, 9600, 4000000, "of slcan's serial line");
    schema.add("slcan_silent", config.slcan_silent, "the adapter never answers commands");
}

std::unique_ptr<CanBus> open_can_bus(const CanConfig& config) {
    const std::size_t colon = config.port.find(':');
    const std::string kind = config.port.substr(0, colon);
    const std::string rest = colon == std::string::npos ? "" : config.port.substr(colon + 1);
    if (colon == std::string::npos && !kind.empty() && kind.find('/') == std::string::npos) {
        return open_socket_can(kind);
    }
    if (kind == "slcan" && !rest.empty()) {
        return open_slcan(config, rest);
    }
    if (kind == "candump" && !rest.empty()) {
        return open_candump_sink(rest);
    }
    throw Error("'" + config.port +
                "': not a CAN port like can0, slcan:/dev/ttyACM0 or candump:FILE");
}

}  // namespace hybrid_slam
