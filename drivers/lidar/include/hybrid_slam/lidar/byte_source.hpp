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
    /// leaves it empty when nothing came in time. Throws Error ("<port>: unplugged") when the
    /// device is gone; it has to be opened anew then.
    virtual void read(std::vector<std::uint8_t>& bytes, double timeout) = 0;

    /// True once a file was read to its end: nothing more will come. A device never ends.
    virtual bool ended() const { return false; }
};

/// Opens what `config.port` names: tcp://host:port, a character device (raw, 8N1, config.baud, for
/// this process alone) or a plain file, which is played back at the pace of its scan counter, as if
/// it came from the line now. Throws Error with the port's name and the reason; blocks for some
/// seconds while a TCP peer or a name server does not answer.
std::unique_ptr<ByteSource> open_byte_source(const LidarConfig& config);

}  // namespace hybrid_slam
