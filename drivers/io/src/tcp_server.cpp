// SPDX-License-Identifier: Apache-2.0
#include "io/tcp_server.hpp"

#include <chrono>
#include <exception>
#include <utility>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

using asio::ip::tcp;

constexpr auto kAcceptPause = std::chrono::milliseconds(100);  // when out of sockets

Endpoint endpoint_of(const tcp::acceptor& acceptor) {
    std::error_code ignored;
    const tcp::endpoint local = acceptor.local_endpoint(ignored);
    return {local.address().to_string(), local.port()};
}

}  // namespace

tcp::acceptor listen_on(asio::io_context& context, const Endpoint& endpoint) {
    if (endpoint.host.empty()) {
        throw Error(endpoint.text() + ": cannot listen: no host");  // would be all interfaces
    }
    std::error_code error;
    tcp::resolver resolver(context);
    const auto found = resolver.resolve(endpoint.host, std::to_string(endpoint.port),
                                        tcp::resolver::passive, error);
    tcp::acceptor acceptor(context);
    if (!error) {
        const tcp::endpoint address = found.begin()->endpoint();
        acceptor.open(address.protocol(), error);
        if (!error) {
            acceptor.set_option(tcp::acceptor::reuse_address(true), error);
            acceptor.bind(address, error);
        }
        if (!error) {
            acceptor.listen(tcp::acceptor::max_listen_connections, error);
        }
    }
    if (error) {
        throw Error(endpoint.text() + ": cannot listen: " + error.message());
    }
    return acceptor;
}

TcpServer::TcpServer(const Endpoint& endpoint, std::function<void(tcp::socket)> take)
    : acceptor_(listen_on(context_, endpoint)),
      endpoint_(endpoint_of(acceptor_)),
      pause_(context_),
      take_(std::move(take)),
      thread_([this] { run(); }) {}

TcpServer::~TcpServer() {
    stop();
}

void TcpServer::stop() {
    context_.stop();
    if (thread_.joinable()) {
        thread_.join();
    }
}

void TcpServer::run() {
    accept();
    while (!context_.stopped()) {
        try {
            context_.run();
        } catch (const std::exception&) {
            // No memory, at worst, for what one handler was to do: the next ones may have it.
            continue;
        }
    }
}

void TcpServer::accept() {
    acceptor_.async_accept([this](std::error_code error, tcp::socket socket) {
        if (error) {
            pause_.expires_after(kAcceptPause);
            pause_.async_wait([this](std::error_code) { accept(); });
            return;
        }
        accept();
        take_(std::move(socket));
    });
}

}  // namespace hybrid_slam
