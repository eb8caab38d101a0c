// SPDX-License-Identifier: Apache-2.0
#include "serial_device.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "hybrid_slam/core/error.hpp"

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

speed_t speed_code(int baud, const std::string& name) {
    constexpr std::array<std::pair<int, speed_t>, 14> kCodes = {{{9600, B9600},
                                                                 {19200, B19200},
                                                                 {38400, B38400},
                                                                 {57600, B57600},
                                                                 {115200, B115200},
                                                                 {230400, B230400},
                                                                 {460800, B460800},
                                                                 {500000, B500000},
                                                                 {576000, B576000},
                                                                 {921600, B921600},
                                                                 {1000000, B1000000},
                                                                 {2000000, B2000000},
                                                                 {3000000, B3000000},
                                                                 {4000000, B4000000}}};
    for (const auto& [rate, code] : kCodes) {
        if (rate == baud) {
            return code;
        }
    }
    throw Error(name + ": baud: " + std::to_string(baud) + " is no usual rate (115200, 1000000)");
}

}  // namespace

SerialDevice::SerialDevice(const std::string& device, int baud, const std::string& name)
    : name_(name), descriptor_(::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)) {
    if (descriptor_ < 0) {
        throw Error(name_ + ": " + open_reason(errno));
    }
    try {
        // Two drivers on one line would steal each other's answers.
        if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
            throw Error(name_ + ": " + open_reason(errno));
        }
        set_up(baud);
    } catch (...) {
        ::close(descriptor_);
        throw;
    }
}

SerialDevice::~SerialDevice() {
    ::close(descriptor_);
}

void SerialDevice::set_up(int baud) const {
    termios mode{};
    if (tcgetattr(descriptor_, &mode) != 0) {
        throw Error(name_ + ": not a serial port");
    }
    cfmakeraw(&mode);
    mode.c_cflag |= static_cast<tcflag_t>(CLOCAL | CREAD);
    mode.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
    if (cfsetspeed(&mode, speed_code(baud, name_)) != 0 ||
        tcsetattr(descriptor_, TCSANOW, &mode) != 0) {
        throw Error(name_ + ": " + std::to_string(baud) +
                    " baud refused: " + std::generic_category().message(errno));
    }
    tcflush(descriptor_, TCIOFLUSH);
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
