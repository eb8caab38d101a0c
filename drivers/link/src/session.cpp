// SPDX-License-Identifier: Apache-2.0
#include "session.hpp"

#include <asio/buffer.hpp>
#include <asio/connect.hpp>
#include <asio/io_context.hpp>
#include <asio/write.hpp>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/link/codec.hpp"
#include "socket_options.hpp"

namespace hybrid_slam {
namespace {

using asio::ip::tcp;

constexpr std::size_t kMostLineBytes = 65536;
constexpr double kPace = 0.01;  // s

}  // namespace

Session::Session(asio::io_context& context, const Setup& setup, Mailbox& mailbox,
                 std::function<void(bool)> on_end)
    : setup_(setup),
      mailbox_(mailbox),
      on_end_(std::move(on_end)),
      resolver_(context),
      socket_(context),
      deadline_(context),
      pace_(context),
      buffer_(kMostLineBytes) {}

void Session::start() {
    mailbox_.connecting();
    deadline_.expires_after(nanoseconds(setup_.patience));
    deadline_.async_wait([self = shared_from_this()](std::error_code error) {
        if (!error && !self->is_welcome_) {
            self->end("no answer");
        }
    });
    resolver_.async_resolve(setup_.server.host, std::to_string(setup_.server.port),
                            [self = shared_from_this()](std::error_code error,
                                                        const tcp::resolver::results_type& found) {
                                if (self->is_over_) {
                                    return;
                                }
                                if (error) {
                                    self->end(error.message());
                                } else {
                                    self->connect(found);
                                }
                            });
}

void Session::connect(const tcp::resolver::results_type& found) {
    asio::async_connect(socket_, found,
                        [self = shared_from_this()](std::error_code error, const tcp::endpoint&) {
                            if (self->is_over_) {
                                return;
                            }
                            if (error) {
                                self->end(error.message());
                                return;
                            }
                            set_up(self->socket_, self->setup_.patience);
                            self->write(self->setup_.hello);
                            self->read();
                        });
}

void Session::read() {
    socket_.async_read_some(asio::buffer(chunk_), [self = shared_from_this()](std::error_code error,
                                                                              std::size_t count) {
        if (self->is_over_) {
            return;
        }
        if (error) {
            self->end(error == asio::error::eof ? "closed by the server" : error.message());
            return;
        }
        self->buffer_.append(self->chunk_.data(), count);
        std::string line;
        while (!self->is_over_ && self->buffer_.next(line)) {
            self->take_line(line);
        }
        if (self->buffer_.is_overlong()) {
            self->end("the server's lines are too long");
        }
        if (!self->is_over_) {
            self->read();
        }
    });
}

void Session::take_line(std::string_view line) {
    ServerMessage message;
    try {
        message = decode_server_json(line);
    } catch (const Error& error) {
        // A newer server may say more than we know; one that never welcomes us is none of ours.
        if (!is_welcome_) {
            end("not a link server: " + std::string(error.what()));
        }
        return;
    }
    if (const auto* const refusal = std::get_if<LinkRefusal>(&message)) {
        refusal_ = refusal->reason;
    }
    if (std::holds_alternative<LinkWelcome>(message)) {
        is_welcome_ = true;
        deadline_.cancel();
        mailbox_.connected();
        pump();
        return;
    }
    mailbox_.came(message);
}

/// What a stalled network holds would come late: nothing is added to it.
bool Session::is_stalled() {
    const double now = steady_seconds();
    const std::size_t confirmed = written_ - std::min(written_, unconfirmed_bytes(socket_));
    if (confirmed == written_ || confirmed > confirmed_) {
        moved_at_ = now;
    }
    confirmed_ = confirmed;
    return now - moved_at_ > setup_.stale_after;
}

void Session::pump() {
    if (!is_welcome_ || is_writing_ || is_over_) {
        return;
    }
    if (std::optional<std::string> order = mailbox_.next_order()) {
        write(std::move(*order));
        return;
    }
    if (!mailbox_.has_pose()) {
        return;
    }
    if (!is_stalled()) {
        if (std::optional<std::string> pose =
                mailbox_.next_pose(steady_seconds(), setup_.stale_after)) {
            write(std::move(*pose));
        }
        return;
    }
    if (!is_pacing_) {
        is_pacing_ = true;
        pace_.expires_after(nanoseconds(kPace));
        pace_.async_wait([self = shared_from_this()](std::error_code) {
            self->is_pacing_ = false;
            self->pump();
        });
    }
}

void Session::write(std::string line) {
    is_writing_ = true;
    line_ = std::move(line) + "\n";
    asio::async_write(socket_, asio::buffer(line_),
                      [self = shared_from_this()](std::error_code error, std::size_t count) {
                          self->is_writing_ = false;
                          if (self->is_over_) {
                              return;
                          }
                          if (error) {
                              self->end(error.message());
                              return;
                          }
                          self->written_ += count;
                          if (self->is_welcome_) {
                              self->mailbox_.sent();
                          }
                          self->pump();
                      });
}

void Session::end(const std::string& trouble) {
    if (is_over_) {
        return;
    }
    is_over_ = true;
    std::error_code ignored;
    deadline_.cancel();
    pace_.cancel();
    resolver_.cancel();
    socket_.close(ignored);
    mailbox_.disconnected(setup_.server.text() + ": " + (refusal_.empty() ? trouble : refusal_));
    on_end_(is_welcome_);
}

}  // namespace hybrid_slam
