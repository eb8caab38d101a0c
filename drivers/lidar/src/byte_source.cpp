// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/lidar/byte_source.hpp"

#include <filesystem>

#include "byte_sources.hpp"
#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {

std::unique_ptr<ByteSource> open_byte_source(const LidarConfig& config) {
    if (config.port.rfind(kTcpScheme, 0) == 0) {
        return open_tcp_client(config);
    }
    std::error_code error;
    const auto status = std::filesystem::status(config.port, error);
    if (std::filesystem::is_regular_file(status)) {
        return open_byte_file(config);
    }
    // What is not there is said by opening it, with the advice that belongs to devices.
    if (std::filesystem::exists(status) && !std::filesystem::is_character_file(status)) {
        throw Error(config.port + ": neither a serial port nor a file");
    }
    return open_serial_port(config);
}

}  // namespace hybrid_slam
