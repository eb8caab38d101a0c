// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "hybrid_slam/lidar/byte_source.hpp"

namespace hybrid_slam {

inline constexpr char kTcpScheme[] = "tcp://";

// The kinds of byte source; open_byte_source chooses. Each throws Error with the port's name.

std::unique_ptr<ByteSource> open_serial_port(const LidarConfig& config);
std::unique_ptr<ByteSource> open_tcp_client(const LidarConfig& config);
std::unique_ptr<ByteSource> open_byte_file(const LidarConfig& config);

}  // namespace hybrid_slam
