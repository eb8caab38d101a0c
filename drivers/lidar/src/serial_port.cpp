// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <asio/posix/stream_descriptor.hpp>
#include <cerrno>

#include "byte_sources.hpp"
#include "hybrid_slam/core/error.hpp"
#include "serial_line.hpp"
#include "timed_read.hpp"

namespace hybrid_slam {
namespace {

std::string open_reason(int error) {
    const std::string reason = std::generic_category().message(error);
    switch (error) {
        case EACCES:
            return reason + " (is the user in the group dialout?)";
        case ENOENT:
        case ENXIO:
        case ENODEV:
            return reason + " (is it plugged in?)";
        case EBUSY:
        case EWOULDBLOCK:
            return "in use by another program";
        default:
            return reason;
    }
}

bool is_hang_up(const std::error_code& error) {
    return error == asio::error::eof || error == std::errc::io_error ||
           error == std::errc::no_such_device || error == std::errc::no_such_device_or_address;
}

/// A pseudo-terminal outlives its reader, and so would its exclusiveness if that is killed.
bool is_pseudo_terminal(int descriptor) {
    constexpr unsigned kFirstMajor = 136;
    constexpr unsigned kLastMajor = 143;
    struct stat status {};
    return fstat(descriptor, &status) == 0 && major(status.st_rdev) >= kFirstMajor &&
           major(status.st_rdev) <= kLastMajor;
}

class SerialPort : public ByteSource {
  public:
    explicit SerialPort(const LidarConfig& config) : name_(config.port), stream_(context_) {
        const int descriptor = ::open(name_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
        if (descriptor < 0) {
            throw Error(name_ + ": " + open_reason(errno));
        }
        stream_.assign(descriptor);
        // Root ignores TIOCEXCL, and pseudo-terminals go without: the lock keeps at least a second
        // one of us away, who would take every other byte.
        if (flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
            throw Error(name_ + ": " + open_reason(errno));
        }
        set_up_serial_line(descriptor, config.baud, name_);
        if (!is_pseudo_terminal(descriptor)) {
            keep_for_us(descriptor);
            exclusive_ = true;
        }
    }

    ~SerialPort() override {
        if (exclusive_) {
            give_back(stream_.native_handle());
        }
    }

    void read(std::vector<std::uint8_t>& bytes, double timeout) override {
        const std::error_code error = read_within(context_, stream_, bytes, timeout);
        if (error) {
            throw Error(name_ + ": " + (is_hang_up(error) ? "unplugged" : error.message()));
        }
    }

  private:
    std::string name_;
    asio::io_context context_;
    asio::posix::stream_descriptor stream_;
    bool exclusive_ = false;
};

}  // namespace

std::unique_ptr<ByteSource> open_serial_port(const LidarConfig& config) {
    return std::make_unique<SerialPort>(config);
}

}  // namespace hybrid_slam
