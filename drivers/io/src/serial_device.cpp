// SPDX-License-Identifier: Apache-2.0
#include "io/serial_device.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>

#include "hybrid_slam/core/error.hpp"
#include "serial_line.hpp"

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

/// A pseudo-terminal outlives its reader, and so would its exclusiveness if that is killed.
bool is_pseudo_terminal(int descriptor) {
    constexpr unsigned kFirstMajor = 136;
    constexpr unsigned kLastMajor = 143;
    struct stat status {};
    return fstat(descriptor, &status) == 0 && major(status.st_rdev) >= kFirstMajor &&
           major(status.st_rdev) <= kLastMajor;
}

}  // namespace

SerialDevice::SerialDevice(const std::string& device, int baud, const std::string& name)
    : name_(name), descriptor_(::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)) {
    if (descriptor_ < 0) {
        throw Error(name_ + ": " + open_reason(errno));
    }
    try {
        // Root ignores TIOCEXCL, and pseudo-terminals go without: the lock keeps at least a second
        // one of us away, who would take every other byte.
        if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
            throw Error(name_ + ": " + open_reason(errno));
        }
        set_up_serial_line(descriptor_, baud, name_);
    } catch (...) {
        ::close(descriptor_);
        throw;
    }
    exclusive_ = !is_pseudo_terminal(descriptor_) && ioctl(descriptor_, TIOCEXCL) == 0;
}

SerialDevice::~SerialDevice() {
    if (exclusive_) {
        ioctl(descriptor_, TIOCNXCL);
    }
    ::close(descriptor_);
}

std::string SerialDevice::read() {
    std::array<char, 4096> bytes{};
    const ssize_t count = ::read(descriptor_, bytes.data(), bytes.size());
    if (count > 0) {
        return {bytes.data(), static_cast<std::size_t>(count)};
    }
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) {
        return {};
    }
    throw Error(name_ + ": unplugged");
}

std::size_t SerialDevice::write(const std::string& bytes) {
    const ssize_t count = ::write(descriptor_, bytes.data(), bytes.size());
    if (count >= 0) {
        return static_cast<std::size_t>(count);
    }
    if (errno == EAGAIN || errno == EINTR) {
        return 0;
    }
    throw Error(name_ + ": unplugged");
}

std::size_t SerialDevice::unsent() const {
    int count = 0;
    return ioctl(descriptor_, TIOCOUTQ, &count) == 0 && count > 0 ? static_cast<std::size_t>(count)
                                                                  : 0;
}

void SerialDevice::forget_unsent() const {
    tcflush(descriptor_, TCOFLUSH);
}

}  // namespace hybrid_slam
