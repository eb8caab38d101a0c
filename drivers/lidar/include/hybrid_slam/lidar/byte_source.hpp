// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hybrid_slam/lidar/lidar_config.hpp"

namespace hybrid_slam {

/// Where bytes come from: a serial port, a TCP connection, a file.
class ByteSource {
  public:
    ByteSource() = default;
    ByteSource(const ByteSource&) = delete;
    ByteSource& operator=(const ByteSource&) = delete;
    virtual ~ByteSource() = default;

    /// Replaces `bytes` by what is there, waiting at most `timeout` seconds for the first byte;
    /// leaves it empty when nothing came in time. Throws Error when the device is gone ("..., :
    /// unplugged") or the file ended.
    virtual void read(std::vector<std::uint8_t>& bytes, double timeout) = 0;
};

/// Opens what `config.port` names: tcp://host:port, a character device (raw, 8N1, config.baud) or a
/// plain file. Throws Error with the port's name and the reason.
std::unique_ptr<ByteSource> open_byte_source(const LidarConfig& config);

}  // namespace hybrid_slam
