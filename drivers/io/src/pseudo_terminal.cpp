// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/io/pseudo_terminal.hpp"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

[[noreturn]] void fail(const std::string& what) {
    throw Error(what + ": " + std::generic_category().message(errno));
}

}  // namespace

PseudoTerminal::PseudoTerminal(std::filesystem::path link) : link_(std::move(link)) {
    try {
        open();
        if (!link_.empty()) {
            make_link();
        }
    } catch (...) {
        if (master_ >= 0) {
            close(master_);
        }
        throw;
    }
}

void PseudoTerminal::open() {
    master_ = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    std::array<char, 128> name{};
    if (master_ < 0 || grantpt(master_) != 0 || unlockpt(master_) != 0 ||
        ptsname_r(master_, name.data(), name.size()) != 0) {
        fail("pseudo-terminal");
    }
    device_ = name.data();
    // Raw from the start, or the terminal would echo and translate what is written before the
    // reader has set its own mode.
    termios mode{};
    if (tcgetattr(master_, &mode) != 0) {
        fail(device_);
    }
    cfmakeraw(&mode);
    if (tcsetattr(master_, TCSANOW, &mode) != 0) {
        fail(device_);
    }
    // The hang-up that tells that nobody listens is only raised when a reader has closed it.
    const int reader = ::open(device_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (reader < 0) {
        fail(device_);
    }
    close(reader);
}

/// By renaming, so that whoever waits for the name never finds it missing.
void PseudoTerminal::make_link() const {
    const auto status = std::filesystem::symlink_status(link_);
    if (std::filesystem::exists(status) && !std::filesystem::is_symlink(status)) {
        throw Error(link_.string() + ": exists and is no symbolic link");
    }
    const std::filesystem::path fresh = link_.string() + ".new";
    std::error_code error;
    std::filesystem::remove(fresh, error);
    std::filesystem::create_symlink(device_, fresh, error);
    if (!error) {
        std::filesystem::rename(fresh, link_, error);
    }
    if (error) {
        throw Error(link_.string() + ": " + error.message());
    }
}

PseudoTerminal::~PseudoTerminal() {
    std::error_code error;
    if (!link_.empty() && std::filesystem::read_symlink(link_, error) == device_) {
        std::filesystem::remove(link_, error);
    }
    close(master_);
}

bool PseudoTerminal::has_reader() const {
    pollfd state{master_, POLLOUT, 0};
    return poll(&state, 1, 0) >= 0 && (state.revents & POLLHUP) == 0;
}

/// What the last reader has not read would greet the next one as stale data; only the reading end
/// can drop it.
void PseudoTerminal::forget_leftovers() {
    had_reader_ = false;
    const int reader = ::open(device_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (reader >= 0) {
        tcflush(reader, TCIFLUSH);
        close(reader);
    }
}

void PseudoTerminal::write(const std::vector<std::uint8_t>& bytes) {
    write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

std::size_t PseudoTerminal::write(std::string_view bytes) {
    if (!has_reader()) {
        if (had_reader_) {
            forget_leftovers();
        }
        dropped_ += bytes.size();
        return 0;
    }
    had_reader_ = true;
    std::size_t done = 0;
    while (done < bytes.size()) {
        const ssize_t count = ::write(master_, bytes.data() + done, bytes.size() - done);
        if (count < 0 && errno == EINTR) {
            continue;
        }
        if (count <= 0) {
            break;
        }
        done += static_cast<std::size_t>(count);
    }
    dropped_ += bytes.size() - done;
    return done;
}

std::string PseudoTerminal::read() const {
    std::array<char, 4096> bytes{};
    const ssize_t count = ::read(master_, bytes.data(), bytes.size());
    return {bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(count, 0))};
}

}  // namespace hybrid_slam
