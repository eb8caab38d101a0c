// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

namespace hybrid_slam::test {

inline constexpr double kLongWait = 20.0;  // s: only a failing test waits so long

/// A TCP socket on loopback without any of our code, for the other end of what is tested.
class RawSocket {
  public:
    explicit RawSocket(int descriptor) : descriptor_(descriptor) {
        if (descriptor_ < 0) {
            throw std::runtime_error("no socket");
        }
    }
    RawSocket(RawSocket&& other) noexcept
        : descriptor_(std::exchange(other.descriptor_, -1)), pending_(std::move(other.pending_)) {}
    RawSocket& operator=(RawSocket&&) = delete;
    ~RawSocket() { close(); }

    /// With `receive_bytes` the system's buffer is made that small, for a slow reader.
    static RawSocket connect(std::uint16_t port, int receive_bytes = 0) {
        RawSocket result(::socket(AF_INET, SOCK_STREAM, 0));
        result.limit(receive_bytes);
        const sockaddr_in address = loopback(port);
        if (::connect(result.descriptor_, reinterpret_cast<const sockaddr*>(&address),
                      sizeof(address)) != 0) {
            throw std::runtime_error("cannot connect");
        }
        return result;
    }

    static RawSocket listen(std::uint16_t port = 0, int receive_bytes = 0) {
        RawSocket result(::socket(AF_INET, SOCK_STREAM, 0));
        result.limit(receive_bytes);
        const int yes = 1;
        ::setsockopt(result.descriptor_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
        const sockaddr_in address = loopback(port);
        if (::bind(result.descriptor_, reinterpret_cast<const sockaddr*>(&address),
                   sizeof(address)) != 0 ||
            ::listen(result.descriptor_, 8) != 0) {
            throw std::runtime_error("cannot listen");
        }
        return result;
    }

    std::uint16_t port() const {
        sockaddr_in address{};
        socklen_t size = sizeof(address);
        ::getsockname(descriptor_, reinterpret_cast<sockaddr*>(&address), &size);
        return ntohs(address.sin_port);
    }

    RawSocket accept() {
        if (!is_readable(kLongWait)) {
            throw std::runtime_error("nobody connects");
        }
        return RawSocket(::accept(descriptor_, nullptr, nullptr));
    }

    /// False when the other end is gone.
    bool send(const std::string& bytes) {
        std::size_t done = 0;
        while (done < bytes.size()) {
            const ssize_t count =
                ::send(descriptor_, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
            if (count <= 0) {
                return false;
            }
            done += static_cast<std::size_t>(count);
        }
        return true;
    }

    /// Nothing when the other end has closed, or says nothing for `timeout` seconds.
    std::optional<std::string> line(double timeout = kLongWait) {
        std::size_t end = pending_.find('\n');
        while (end == std::string::npos) {
            if (!receive(timeout)) {
                return std::nullopt;
            }
            end = pending_.find('\n');
        }
        std::string result = pending_.substr(0, end);
        pending_.erase(0, end + 1);
        return result;
    }

    /// Reads until the other end closes; whether it did.
    bool is_closed() {
        while (receive(kLongWait)) {
        }
        return has_ended_;
    }

    void close() {
        if (descriptor_ >= 0) {
            ::close(std::exchange(descriptor_, -1));
        }
    }

  private:
    void limit(int receive_bytes) const {
        if (receive_bytes > 0) {
            ::setsockopt(descriptor_, SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof(receive_bytes));
        }
    }

    static sockaddr_in loopback(std::uint16_t port) {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(port);
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        return address;
    }

    bool is_readable(double timeout) const {
        pollfd request{descriptor_, POLLIN, 0};
        return ::poll(&request, 1, static_cast<int>(1000.0 * timeout)) > 0;
    }

    bool receive(double timeout) {
        char bytes[4096];
        if (!is_readable(timeout)) {
            return false;
        }
        const ssize_t count = ::recv(descriptor_, bytes, sizeof(bytes), 0);
        has_ended_ = count <= 0;
        pending_.append(bytes, has_ended_ ? 0 : static_cast<std::size_t>(count));
        return !has_ended_;
    }

    int descriptor_;
    std::string pending_;
    bool has_ended_ = false;
};

}  // namespace hybrid_slam::test
