// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "support/temp_folder.hpp"

extern char** environ;  // NOLINT: POSIX has it so

namespace hybrid_slam::test {

inline constexpr const char* kMosquitto = "/usr/sbin/mosquitto";

/// Generous: a test that needs it all fails anyway.
template <typename Condition>
bool eventually(Condition&& condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!condition()) {
        if (std::chrono::steady_clock::now() > end) {
            return false;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return true;
}

/// A program that is killed with the object.
class Process {
  public:
    explicit Process(std::vector<std::string> words) {
        std::vector<char*> arguments;
        for (std::string& word : words) {
            arguments.push_back(word.data());
        }
        arguments.push_back(nullptr);
        EXPECT_EQ(posix_spawn(&id_, arguments[0], nullptr, nullptr, arguments.data(), environ), 0);
    }
    ~Process() { kill_now(); }
    Process(const Process&) = delete;
    Process& operator=(const Process&) = delete;

    /// Without a chance to say good-bye.
    void kill_now() {
        if (id_ > 0) {
            ::kill(id_, SIGKILL);
            ::waitpid(id_, nullptr, 0);
            id_ = 0;
        }
    }

  private:
    pid_t id_ = 0;
};

inline int free_port() {
    const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const generic = reinterpret_cast<sockaddr*>(&address);
    EXPECT_EQ(::bind(socket, generic, size), 0);
    EXPECT_EQ(::getsockname(socket, generic, &size), 0);
    ::close(socket);
    return ntohs(address.sin_port);
}

/// A mosquitto of the running test alone, with nothing stored.
class Broker {
  public:
    explicit Broker(bool lets_all_in = true) : port_(free_port()) {
        folder_.write("mosquitto.conf", "listener " + std::to_string(port_) +
                                            " 127.0.0.1\nallow_anonymous " +
                                            (lets_all_in ? "true" : "false") +
                                            "\npersistence false\nlog_type none\n");
        start();
    }

    void start() {
        process_ = std::make_unique<Process>(
            std::vector<std::string>{kMosquitto, "-c", (folder_ / "mosquitto.conf").string()});
    }
    void stop() { process_.reset(); }

    std::string address() const { return "tcp://127.0.0.1:" + std::to_string(port_); }

  private:
    TempFolder folder_;
    int port_;
    std::unique_ptr<Process> process_;
};

}  // namespace hybrid_slam::test
