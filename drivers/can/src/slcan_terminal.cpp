// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/can/slcan_terminal.hpp"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>

#include "deadline.hpp"
#include "device_link.hpp"
#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {

SlcanTerminal::SlcanTerminal(const std::filesystem::path& link) {
    try {
        open();
        if (!link.empty()) {
            link_ = std::make_unique<DeviceLink>(link, path_);
            path_ = link.string();
        }
    } catch (...) {
        if (master_ >= 0) {
            ::close(master_);
        }
        throw;
    }
}

void SlcanTerminal::open() {
    master_ = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    std::array<char, 128> name{};
    termios mode{};
    bool made = master_ >= 0 && grantpt(master_) == 0 && unlockpt(master_) == 0 &&
                ptsname_r(master_, name.data(), name.size()) == 0 && tcgetattr(master_, &mode) == 0;
    if (made) {
        cfmakeraw(&mode);  // or it would echo until the host has set its own mode
        made = tcsetattr(master_, TCSANOW, &mode) == 0;
    }
    if (!made) {
        throw Error("pseudo-terminal: " + std::generic_category().message(errno));
    }
    path_ = name.data();
}

SlcanTerminal::~SlcanTerminal() {
    link_.reset();
    ::close(master_);
}

std::vector<CanFrame> SlcanTerminal::receive(double timeout) {
    const Deadline deadline(timeout);
    // While nobody has it open, polling tells of the hang-up at once.
    while (deadline.wait_for(master_)) {
        std::array<char, 4096> bytes{};
        const ssize_t count = ::read(master_, bytes.data(), bytes.size());
        if (count > 0) {
            SlcanAdapter::Result result =
                adapter_.push({bytes.data(), static_cast<std::size_t>(count)});
            write(result.answer);
            return std::move(result.frames);
        }
        if (deadline.passed()) {
            break;
        }
        constexpr double kMostSleep = 0.005;  // seconds
        usleep(static_cast<useconds_t>(std::min(kMostSleep, deadline.left()) * 1e6));
    }
    return {};
}

bool SlcanTerminal::send(const CanFrame& frame) {
    if (is_open()) {
        return write(to_slcan(frame));
    }
    ++dropped_;
    return false;
}

bool SlcanTerminal::write(const std::string& bytes) {
    if (bytes.empty()) {
        return true;
    }
    pollfd state{master_, POLLOUT, 0};
    const bool connected = poll(&state, 1, 0) > 0 && (state.revents & POLLHUP) == 0;
    const bool written = connected && ::write(master_, bytes.data(), bytes.size()) ==
                                          static_cast<ssize_t>(bytes.size());
    dropped_ += written ? 0 : 1;
    return written;
}

}  // namespace hybrid_slam
