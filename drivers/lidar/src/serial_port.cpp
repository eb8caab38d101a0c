// SPDX-License-Identifier: Apache-2.0
#include <asio/posix/stream_descriptor.hpp>

#include "byte_sources.hpp"
#include "hybrid_slam/core/error.hpp"
#include "io/serial_device.hpp"
#include "timed_read.hpp"

namespace hybrid_slam {
namespace {

bool is_hang_up(const std::error_code& error) {
    return error == asio::error::eof || error == std::errc::io_error ||
           error == std::errc::no_such_device || error == std::errc::no_such_device_or_address;
}

class SerialPort : public ByteSource {
  public:
    explicit SerialPort(const LidarConfig& config)
        : device_(config.port, config.baud, config.port), stream_(context_) {
        stream_.assign(device_.descriptor());
    }

    ~SerialPort() override { stream_.release(); }

    void read(std::vector<std::uint8_t>& bytes, double timeout) override {
        const std::error_code error = read_within(context_, stream_, bytes, timeout);
        if (error) {
            throw Error(device_.name() + ": " +
                        (is_hang_up(error) ? "unplugged" : error.message()));
        }
    }

  private:
    SerialDevice device_;
    asio::io_context context_;
    asio::posix::stream_descriptor stream_;
};

}  // namespace

std::unique_ptr<ByteSource> open_serial_port(const LidarConfig& config) {
    return std::make_unique<SerialPort>(config);
}

}  // namespace hybrid_slam
