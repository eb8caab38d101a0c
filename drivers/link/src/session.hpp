// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <asio/ip/tcp.hpp>
#include <asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "hybrid_slam/io/endpoint.hpp"
#include "line_buffer.hpp"
#include "mailbox.hpp"

namespace hybrid_slam {

/// One attempt of a client at a connection, and the connection if there is one.
class Session : public std::enable_shared_from_this<Session> {
  public:
    struct Setup {
        Endpoint server;
        std::string hello;  ///< the first line
        double patience = 0.0;
        double stale_after = 0.0;
    };

    /// `on_end` is called once, with whether the server had welcomed us.
    Session(asio::io_context& context, const Setup& setup, Mailbox& mailbox,
            std::function<void(bool)> on_end);

    void start();
    /// Sends what waits in the mailbox.
    void pump();

  private:
    void connect(const asio::ip::tcp::resolver::results_type& found);
    void read();
    void take_line(std::string_view line);
    bool is_stalled();
    void write(std::string line);
    void end(const std::string& trouble);

    Setup setup_;
    Mailbox& mailbox_;
    std::function<void(bool)> on_end_;
    asio::ip::tcp::resolver resolver_;
    asio::ip::tcp::socket socket_;
    asio::steady_timer deadline_;  ///< for the welcome
    asio::steady_timer pace_;      ///< looks again whether a stalled network moves
    std::array<char, 4096> chunk_{};
    LineBuffer buffer_;
    std::string line_;  ///< being written
    std::string refusal_;
    bool is_writing_ = false;
    bool is_pacing_ = false;
    bool is_welcome_ = false;
    bool is_over_ = false;
    std::size_t written_ = 0;    ///< bytes given to the system
    std::size_t confirmed_ = 0;  ///< of these, by the server's system
    double moved_at_ = 0.0;      ///< when that last grew, or nothing was open
};

}  // namespace hybrid_slam
