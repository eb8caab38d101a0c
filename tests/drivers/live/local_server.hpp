// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <string>
#include <vector>

namespace hybrid_slam::test {

/// A serial-to-Ethernet converter with one customer, on this machine.
class LocalServer {
  public:
    /// Port 0 takes any that is free.
    explicit LocalServer(std::uint16_t port = 0) {
        listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
        const int on = 1;
        setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        address.sin_port = htons(port);
        EXPECT_EQ(bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
        EXPECT_EQ(listen(listener_, 4), 0);
        socklen_t size = sizeof address;
        getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
        port_ = ntohs(address.sin_port);
    }
    ~LocalServer() {
        hang_up();
        close(listener_);
    }
    LocalServer(const LocalServer&) = delete;
    LocalServer& operator=(const LocalServer&) = delete;

    std::uint16_t port() const { return port_; }
    std::string url() const { return "tcp://127.0.0.1:" + std::to_string(port_); }

    void accept() { customer_ = ::accept(listener_, nullptr, nullptr); }
    void write(const std::vector<std::uint8_t>& bytes) const {
        EXPECT_EQ(send(customer_, bytes.data(), bytes.size(), MSG_NOSIGNAL),
                  static_cast<ssize_t>(bytes.size()));
    }
    void hang_up() {
        if (customer_ >= 0) {
            close(customer_);
        }
        customer_ = -1;
    }

  private:
    int listener_ = -1;
    int customer_ = -1;
    std::uint16_t port_ = 0;
};

}  // namespace hybrid_slam::test
