// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <asio/ip/tcp.hpp>
#include <asio/steady_timer.hpp>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "event_box.hpp"
#include "hybrid_slam/link/link_server.hpp"
#include "lateness.hpp"
#include "line_buffer.hpp"
#include "line_rate.hpp"

namespace hybrid_slam {

class Connection;

/// One status in both forms, written once for all readers.
struct StatusLines {
    std::shared_ptr<const std::string> json;
    std::shared_ptr<const std::string> text;
};

/// What all connections of a server share. Of the server's thread, but for `counts`.
struct ServerShared {
    explicit ServerShared(const LinkServerConfig& server_config);

    template <typename Change>
    void count(Change&& change) {
        const std::lock_guard<std::mutex> lock(mutex);
        change(counts);
    }

    /// Sends a watcher away for a client of that role, if there is one and it needs to be.
    bool make_room_for(LinkRole role);

    LinkServerConfig config;
    EventBox events;
    std::mutex mutex;
    LinkServerCounts counts;
    StatusLines last_status;
    std::map<std::uint64_t, std::shared_ptr<Connection>> connections;
    int admitted = 0;
};

/// One client of a server, from accept to close.
class Connection : public std::enable_shared_from_this<Connection> {
  public:
    Connection(asio::ip::tcp::socket socket, std::uint64_t id, ServerShared& shared);

    void start();
    void publish(const StatusLines& lines);
    void tell_source(const ServerMessage& message);
    bool is_watching() const { return stage_ == Stage::kAdmitted && role_ == LinkRole::kWatch; }
    bool is_stranger() const { return stage_ == Stage::kNew; }
    void send_away(const std::string& reason);
    void drop() { close("room is needed"); }
    /// The line was good, but what it asks for is not done.
    void object(const std::string& reason);

  private:
    enum class Stage { kNew, kAdmitted, kLeaving, kClosed };
    using Line = std::shared_ptr<const std::string>;

    void read();
    void on_bytes(std::size_t count);
    void take_line(std::string_view line);
    void greet(std::string_view line);
    const char* objection(const LinkHello& hello) const;
    void take_message(std::string_view line);
    void refuse_line(const std::string& reason);
    bool push(decltype(LinkEvent::what) what);
    void say(const ServerMessage& message);
    void enqueue(Line line);
    void write();
    void turn_away(const std::string& reason);
    void leave(const std::string& reason);
    void close(const std::string& reason);
    void farewell(const std::string& reason);
    void allow(double seconds, const char* reason);

    asio::ip::tcp::socket socket_;
    asio::steady_timer deadline_;
    std::uint64_t id_;
    ServerShared& shared_;
    Stage stage_ = Stage::kNew;
    bool is_text_ = false;
    LinkRole role_ = LinkRole::kWatch;
    std::array<char, 4096> chunk_{};
    LineBuffer buffer_;
    LineRate rate_;
    Lateness lateness_;
    double arrival_ = 0.0;
    int refusals_ = 0;
    std::size_t discarded_ = 0;
    std::deque<Line> outbox_;  ///< the first is being written
};

}  // namespace hybrid_slam
