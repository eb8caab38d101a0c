// SPDX-License-Identifier: Apache-2.0
#include "navigation/pose_relay.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam::test {
namespace {

using nlohmann::json;

sockaddr_in loopback(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
}

const sockaddr* plain(const sockaddr_in& address) {
    return reinterpret_cast<const sockaddr*>(&address);
}

/// Listens on any port of the loopback.
int listen_anywhere(std::uint16_t& port) {
    const int listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address = loopback(0);
    socklen_t size = sizeof(address);
    if (listener < 0 || bind(listener, plain(address), size) != 0 || listen(listener, 8) != 0 ||
        getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
        throw Error("no port of the loopback is to be had");
    }
    port = ntohs(address.sin_port);
    return listener;
}

int connect_to(std::uint16_t port) {
    const int connection = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const sockaddr_in address = loopback(port);
    if (connection >= 0 && connect(connection, plain(address), sizeof(address)) != 0) {
        close(connection);
        return -1;
    }
    return connection;
}

void hurry(int connection) {
    const int yes = 1;
    setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof(yes));
}

void write_all(int connection, const std::string& bytes) {
    for (std::size_t at = 0; at < bytes.size();) {
        const ssize_t sent = send(connection, bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
        if (sent <= 0) {
            return;  // the other side is gone, which the next read tells
        }
        at += static_cast<std::size_t>(sent);
    }
}

bool is_known(const json& pose) {
    const std::string status = pose.value("status", "");
    return status == "tracking" || status == "degraded";
}

}  // namespace

std::int64_t wall_microseconds() {
    const auto since = std::chrono::system_clock::now().time_since_epoch();
    return std::chrono::duration_cast<std::chrono::microseconds>(since).count();
}

std::uint16_t free_port() {
    std::uint16_t port = 0;
    close(listen_anywhere(port));
    return port;
}

PoseRelay::PoseRelay(std::uint16_t drive_port)
    : drive_port_(drive_port), listener_(listen_anywhere(port_)), thread_([this] { run(); }) {}

PoseRelay::~PoseRelay() {
    stop_ = true;
    thread_.join();
    close_both();
    close(listener_);
}

std::vector<PassedPose> PoseRelay::passed() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return passed_;
}

void PoseRelay::close_both() {
    for (int* const end : {&client_, &drive_}) {
        if (*end >= 0) {
            close(*end);
        }
        *end = -1;
    }
    from_client_.clear();
}

void PoseRelay::serve_client() {
    const int connection = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (connection < 0) {
        return;
    }
    if (mode_ == RelayMode::kClosed || client_ >= 0) {
        close(connection);
        return;
    }
    client_ = connection;
    drive_ = connect_to(drive_port_);
    if (drive_ < 0) {
        close_both();
        return;
    }
    hurry(client_);
    hurry(drive_);
}

void PoseRelay::run() {
    constexpr int kPatience = 10;  // ms, for a change of mode and the end
    while (!stop_) {
        if (mode_ == RelayMode::kClosed) {
            close_both();
        }
        pollfd ends[] = {{listener_, POLLIN, 0}, {client_, POLLIN, 0}, {drive_, POLLIN, 0}};
        if (poll(ends, 3, kPatience) <= 0) {
            continue;
        }
        if (ends[1].revents != 0) {
            take_from_client();
        }
        if (ends[2].revents != 0 && drive_ >= 0) {
            take_from_drive();
        }
        if (ends[0].revents != 0) {
            serve_client();
        }
    }
}

void PoseRelay::take_from_drive() {
    char bytes[4096];
    const ssize_t count = recv(drive_, bytes, sizeof(bytes), 0);
    if (count <= 0) {
        close_both();
    } else if (mode_ != RelayMode::kSilent) {
        write_all(client_, std::string(bytes, static_cast<std::size_t>(count)));
    }
}

void PoseRelay::take_from_client() {
    char bytes[4096];
    const ssize_t count = recv(client_, bytes, sizeof(bytes), 0);
    if (count <= 0) {
        close_both();
        return;
    }
    from_client_.append(bytes, static_cast<std::size_t>(count));
    for (std::size_t end = 0; (end = from_client_.find('\n')) != std::string::npos;) {
        std::string line = from_client_.substr(0, end);
        from_client_.erase(0, end + 1);
        pass_line(std::move(line));
    }
}

void PoseRelay::pass_line(std::string line) {
    const RelayMode mode = mode_;
    if (mode == RelayMode::kSilent || mode == RelayMode::kClosed) {
        return;
    }
    json pose = json::parse(line, nullptr, false);
    if (!pose.is_object() || pose.value("type", "") != "pose") {
        write_all(drive_, line + "\n");
        return;
    }
    const bool frozen = mode != RelayMode::kPass && !last_pose_.empty();
    if (frozen) {
        json old = json::parse(last_pose_);
        if (mode == RelayMode::kRepeatNew) {
            old["stamp"] = pose["stamp"];
            old["age"] = pose.value("age", 0.0);
        }
        pose = std::move(old);
        line = pose.dump();
    } else {
        last_pose_ = line;
    }
    const PassedPose passed{wall_microseconds(), pose.value("stamp", 0.0), !frozen, is_known(pose)};
    {
        // Before the drive has it, who may tell the test at once.
        const std::lock_guard<std::mutex> lock(mutex_);
        passed_.push_back(passed);
    }
    write_all(drive_, line + "\n");
}

}  // namespace hybrid_slam::test
