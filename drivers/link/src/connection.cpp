// SPDX-License-Identifier: Apache-2.0
#include "connection.hpp"

#include <asio/buffer.hpp>
#include <asio/write.hpp>
#include <exception>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/link/codec.hpp"
#include "socket_options.hpp"

namespace hybrid_slam {
namespace {

constexpr std::size_t kMostEvents = 1024;
constexpr std::size_t kMostLines = 16;           // that wait for one reader
constexpr double kPatience = 5.0;                // s with a peer that confirms nothing
constexpr double kLeaveTime = 1.0;               // s for it to read the last line
constexpr std::size_t kMostDiscarded = 1 << 20;  // bytes read from it meanwhile

/// Takes as long for a wrong token as for the right one.
bool same(const std::string& token, const std::string& shown) {
    unsigned difference = token.size() == shown.size() ? 0 : 1;
    for (std::size_t i = 0; i < shown.size(); ++i) {
        difference |= static_cast<unsigned char>(token[i % token.size()]) ^
                      static_cast<unsigned char>(shown[i]);
    }
    return difference == 0;
}

bool may_send(LinkRole role, const ClientMessage& message) {
    if (std::holds_alternative<LinkPose>(message)) {
        return role == LinkRole::kPose;
    }
    return role == LinkRole::kGoal && !std::holds_alternative<LinkHello>(message);
}

}  // namespace

/// Who can stop the vehicle must not be kept out by those who only look on.
bool ServerShared::make_room_for(LinkRole role) {
    if (role == LinkRole::kWatch) {
        return false;
    }
    for (const auto& [id, connection] : connections) {
        if (connection->is_watching()) {
            const std::shared_ptr<Connection> watcher = connection;
            watcher->send_away("room is needed for a client that does more than watch");
            return true;
        }
    }
    return false;
}

ServerShared::ServerShared(const LinkServerConfig& server_config)
    : config(server_config), events(kMostEvents) {}

Connection::Connection(asio::ip::tcp::socket socket, std::uint64_t id, ServerShared& shared)
    : socket_(std::move(socket)),
      deadline_(socket_.get_executor()),
      id_(id),
      shared_(shared),
      buffer_(static_cast<std::size_t>(shared.config.line_bytes)),
      rate_(shared.config.lines_per_second) {}

void Connection::start() {
    set_up(socket_, kPatience);
    allow(shared_.config.hello_timeout, "no first line in time");
    read();
}

/// Until the next call, or the stage changes.
void Connection::allow(double seconds, const char* reason) {
    deadline_.expires_after(nanoseconds(seconds));
    deadline_.async_wait(
        [self = shared_from_this(), stage = stage_, reason](std::error_code error) {
            if (error || self->stage_ != stage) {
                return;
            }
            if (stage == Stage::kNew) {
                self->turn_away(reason);
            } else {
                self->close(reason);
            }
        });
}

void Connection::read() {
    socket_.async_read_some(asio::buffer(chunk_), [self = shared_from_this()](std::error_code error,
                                                                              std::size_t count) {
        if (error) {
            self->close(error == asio::error::eof ? "closed by the client" : error.message());
            return;
        }
        try {
            self->on_bytes(count);
        } catch (const std::exception& trouble) {  // no memory, at worst
            self->close(trouble.what());
        }
        if (self->stage_ != Stage::kClosed) {
            self->read();
        }
    });
}

void Connection::on_bytes(std::size_t count) {
    // A socket that is closed with bytes unread resets, and the peer never reads our last line.
    if (stage_ == Stage::kLeaving) {
        discarded_ += count;
        if (discarded_ > kMostDiscarded) {
            close("");
        }
        return;
    }
    arrival_ = steady_seconds();
    buffer_.append(chunk_.data(), count);
    std::string line;
    while ((stage_ == Stage::kNew || stage_ == Stage::kAdmitted) && buffer_.next(line)) {
        take_line(line);
    }
    if (!buffer_.is_overlong() || stage_ == Stage::kLeaving || stage_ == Stage::kClosed) {
        return;
    }
    const std::string reason =
        "a line has at most " + std::to_string(shared_.config.line_bytes) + " bytes";
    if (stage_ == Stage::kNew) {
        turn_away(reason);
        return;
    }
    shared_.count([](LinkServerCounts& counts) { ++counts.refused; });
    say(LinkRefusal{reason});
    leave(reason);
}

void Connection::take_line(std::string_view line) {
    if (!rate_.allows_one(arrival_)) {
        refuse_line("at most " + std::to_string(shared_.config.lines_per_second) +
                    " lines per second");
        return;
    }
    if (line.empty()) {
        return;
    }
    if (stage_ == Stage::kNew) {
        greet(line);
    } else {
        take_message(line);
    }
}

const char* Connection::objection(const LinkHello& hello) const {
    if (hello.version != kLinkVersion) {
        return "only version 1 is spoken here";
    }
    if (!shared_.config.token.empty() && !same(shared_.config.token, hello.token)) {
        return "wrong token";
    }
    if (shared_.admitted >= shared_.config.most_clients && !shared_.make_room_for(hello.role)) {
        return "too many clients";
    }
    return nullptr;
}

void Connection::greet(std::string_view line) {
    is_text_ = is_text_hello(line);
    LinkHello hello;
    try {
        const ClientMessage first = is_text_ ? decode_client_text(line) : decode_client_json(line);
        if (!std::holds_alternative<LinkHello>(first)) {
            throw Error("type: must be hello");
        }
        hello = std::get<LinkHello>(first);
    } catch (const Error& error) {
        turn_away("the first line must be a hello: " + std::string(error.what()));
        return;
    }
    if (const char* const reason = objection(hello)) {
        turn_away(reason);
        return;
    }
    role_ = hello.role;
    if (!push(LinkConnected{hello.name})) {
        turn_away("busy");
        return;
    }
    stage_ = Stage::kAdmitted;
    deadline_.cancel();
    ++shared_.admitted;
    shared_.count([](LinkServerCounts& counts) { ++counts.connections; });
    say(LinkWelcome{});
    if (shared_.last_status.json) {
        publish(shared_.last_status);
    }
}

void Connection::take_message(std::string_view line) {
    try {
        ClientMessage message = is_text_ ? decode_client_text(line) : decode_client_json(line);
        if (!may_send(role_, message)) {
            throw Error("not for the role of this connection");
        }
        const bool taken = std::visit(
            [this](auto& what) {
                if constexpr (std::is_same_v<std::decay_t<decltype(what)>, LinkHello>) {
                    return false;
                } else {
                    return push(std::move(what));
                }
            },
            message);
        if (!taken) {
            throw Error("busy");
        }
    } catch (const Error& error) {
        refuse_line(error.what());
        return;
    }
    refusals_ -= refusals_ > 0 ? 1 : 0;
    shared_.count([](LinkServerCounts& counts) { ++counts.lines; });
}

void Connection::refuse_line(const std::string& reason) {
    shared_.count([](LinkServerCounts& counts) { ++counts.refused; });
    say(LinkRefusal{reason});
    if (++refusals_ >= shared_.config.refusals) {
        leave("too many refused lines, the last one: " + reason);
    }
}

bool Connection::push(decltype(LinkEvent::what) what) {
    LinkEvent event;
    event.client = id_;
    event.role = role_;
    event.arrival = std::holds_alternative<LinkDisconnected>(what) ? steady_seconds() : arrival_;
    if (const auto* const pose = std::get_if<LinkPose>(&what)) {
        event.lateness = lateness_.of(pose->stamp, arrival_);
    }
    event.what = std::move(what);
    return shared_.events.push(std::move(event));
}

void Connection::say(const ServerMessage& message) {
    const std::string line = is_text_ ? encode_text(message) : encode_json(message);
    enqueue(std::make_shared<const std::string>(line + "\n"));
}

void Connection::publish(const StatusLines& lines) {
    if (stage_ == Stage::kAdmitted) {
        enqueue(is_text_ ? lines.text : lines.json);
    }
}

void Connection::send_away(const std::string& reason) {
    say(LinkRefusal{reason});
    leave(reason);
}

void Connection::tell_source(const ServerMessage& message) {
    if (stage_ == Stage::kAdmitted && role_ == LinkRole::kPose) {
        say(message);
    }
}

void Connection::object(const std::string& reason) {
    if (stage_ == Stage::kAdmitted) {
        say(LinkRefusal{reason});
    }
}

void Connection::enqueue(Line line) {
    if (outbox_.size() >= kMostLines) {
        outbox_.erase(outbox_.begin() + 1);  // the first is on its way
        shared_.count([](LinkServerCounts& counts) { ++counts.statuses_dropped; });
    }
    outbox_.push_back(std::move(line));
    if (outbox_.size() == 1) {
        write();
    }
}

void Connection::write() {
    asio::async_write(socket_, asio::buffer(*outbox_.front()),
                      [self = shared_from_this()](std::error_code error, std::size_t) {
                          if (error) {
                              self->close(error.message());
                              return;
                          }
                          self->outbox_.pop_front();
                          if (!self->outbox_.empty()) {
                              self->write();
                          } else if (self->stage_ == Stage::kLeaving) {
                              self->socket_.shutdown(asio::ip::tcp::socket::shutdown_send, error);
                          }
                      });
}

void Connection::turn_away(const std::string& reason) {
    shared_.count([](LinkServerCounts& counts) { ++counts.turned_away; });
    say(LinkRefusal{reason});
    leave(reason);
}

/// Lets the peer read what was said; nothing that it says counts any more.
void Connection::leave(const std::string& reason) {
    if (stage_ == Stage::kLeaving || stage_ == Stage::kClosed) {
        return;
    }
    farewell(reason);
    stage_ = Stage::kLeaving;
    allow(kLeaveTime, "");
}

void Connection::close(const std::string& reason) {
    if (stage_ == Stage::kClosed) {
        return;
    }
    farewell(reason);
    stage_ = Stage::kClosed;
    std::error_code ignored;
    deadline_.cancel();
    socket_.close(ignored);
    shared_.connections.erase(id_);
}

void Connection::farewell(const std::string& reason) {
    if (stage_ == Stage::kAdmitted) {
        --shared_.admitted;
        push(LinkDisconnected{reason});
    }
}

}  // namespace hybrid_slam
