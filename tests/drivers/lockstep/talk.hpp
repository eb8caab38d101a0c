// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>

namespace hybrid_slam::test {

/// A clock that says what it likes, to one client.
class Listener {
  public:
    Listener() : listener_(socket(AF_INET, SOCK_STREAM, 0)) {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        EXPECT_EQ(bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
        EXPECT_EQ(listen(listener_, 1), 0);
        socklen_t size = sizeof address;
        getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
        port_ = ntohs(address.sin_port);
    }
    ~Listener() {
        close(client_);
        close(listener_);
    }
    Listener(const Listener&) = delete;
    Listener& operator=(const Listener&) = delete;

    std::string url() const { return "tcp://127.0.0.1:" + std::to_string(port_); }
    void accept() { client_ = ::accept(listener_, nullptr, nullptr); }
    void say(const std::string& bytes) const {
        EXPECT_EQ(send(client_, bytes.data(), bytes.size(), MSG_NOSIGNAL),
                  static_cast<ssize_t>(bytes.size()));
    }

  private:
    int listener_;
    int client_ = -1;
    int port_ = 0;
};

/// A client of a clock that says what it likes.
class Talker {
  public:
    explicit Talker(const std::string& url) : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        const int port = std::stoi(url.substr(url.rfind(':') + 1));
        address.sin_port = htons(static_cast<std::uint16_t>(port));
        EXPECT_EQ(connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    }
    ~Talker() { hang_up(); }
    Talker(const Talker&) = delete;
    Talker& operator=(const Talker&) = delete;

    void hang_up() {
        if (socket_ >= 0) {
            close(socket_);
        }
        socket_ = -1;
    }
    void say(const std::string& bytes) const {
        EXPECT_EQ(send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL),
                  static_cast<ssize_t>(bytes.size()));
    }
    /// The next line; empty when the other end has hung up.
    std::string line() const {
        std::string line;
        char letter = 0;
        while (recv(socket_, &letter, 1, 0) == 1 && letter != '\n') {
            line += letter;
        }
        return line;
    }

  private:
    int socket_;
};

}  // namespace hybrid_slam::test
