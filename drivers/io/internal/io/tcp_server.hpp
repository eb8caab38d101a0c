// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/steady_timer.hpp>
#include <functional>
#include <thread>

#include "hybrid_slam/io/endpoint.hpp"

namespace hybrid_slam {

/// Port 0 takes any that is free. Throws Error with the endpoint.
asio::ip::tcp::acceptor listen_on(asio::io_context& context, const Endpoint& endpoint);

/// A thread that takes TCP connections and runs whatever is begun on its context.
class TcpServer {
  public:
    /// Each connection goes to `take`, in the thread. Throws Error when it cannot listen.
    TcpServer(const Endpoint& endpoint, std::function<void(asio::ip::tcp::socket)> take);
    ~TcpServer();
    TcpServer(const TcpServer&) = delete;
    TcpServer& operator=(const TcpServer&) = delete;

    /// Sockets must be gone before the server is: this lets their owner close them in peace.
    void stop();

    asio::io_context& context() { return context_; }
    const Endpoint& endpoint() const { return endpoint_; }

  private:
    void run();
    void accept();

    asio::io_context context_{1};
    asio::ip::tcp::acceptor acceptor_;
    Endpoint endpoint_;
    asio::steady_timer pause_;
    std::function<void(asio::ip::tcp::socket)> take_;
    std::thread thread_;  // last: everything else is there when it begins
};

}  // namespace hybrid_slam
