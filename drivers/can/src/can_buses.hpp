// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "hybrid_slam/can/can_bus.hpp"

namespace hybrid_slam {

// The kinds of bus; open_can_bus chooses. Each throws Error with the port's name.

std::unique_ptr<CanBus> open_socket_can(const std::string& interface);
/// A socket that is open already and is closed with the bus: anything that carries whole
/// can_frames.
std::unique_ptr<CanBus> socket_can_on(int descriptor, const std::string& name);
std::unique_ptr<CanBus> open_slcan(const CanConfig& config, const std::string& device);
std::unique_ptr<CanBus> open_candump_sink(const std::string& file);

}  // namespace hybrid_slam
