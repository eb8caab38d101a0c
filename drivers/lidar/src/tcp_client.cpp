// SPDX-License-Identifier: Apache-2.0
#include <netinet/tcp.h>

#include <asio/connect.hpp>
#include <asio/ip/tcp.hpp>

#include "byte_sources.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/io/endpoint.hpp"
#include "timed_read.hpp"

namespace hybrid_slam {
namespace {

using asio::ip::tcp;

constexpr double kConnectTimeout = 3.0;  // seconds

class TcpClient : public ByteSource {
  public:
    explicit TcpClient(const LidarConfig& config) : name_(config.port), socket_(context_) {
        const Endpoint converter = parse_endpoint(name_);
        if (name_.rfind(std::string(kTcpScheme) + ":", 0) == 0) {
            throw Error(name_ + ": no host; wanted is tcp://host:port");
        }
        std::error_code error;
        tcp::resolver resolver(context_);
        const auto endpoints =
            resolver.resolve(converter.host, std::to_string(converter.port), error);
        if (error) {
            throw Error(name_ + ": " + error.message());
        }
        asio::async_connect(
            socket_, endpoints,
            [&error](const std::error_code& how, const tcp::endpoint&) { error = how; });
        if (!run_within(context_, kConnectTimeout, [this] { socket_.close(); })) {
            throw Error(name_ + ": no answer (is the converter on, is the address right?)");
        }
        if (error) {
            throw Error(name_ + ": " + error.message());
        }
        notice_dead_peers();
    }

    void read(std::vector<std::uint8_t>& bytes, double timeout) override {
        const std::error_code error = read_within(context_, socket_, bytes, timeout);
        if (error) {
            const bool closed = error == asio::error::eof;
            throw Error(name_ + ": " + (closed ? "closed by the other end" : error.message()));
        }
    }

  private:
    /// We never send, so that a converter that lost its power would not be missed otherwise.
    void notice_dead_peers() {
        using Idle = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_KEEPIDLE>;
        using Interval = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_KEEPINTVL>;
        using Count = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_KEEPCNT>;
        std::error_code ignored;
        socket_.set_option(asio::socket_base::keep_alive(true), ignored);
        socket_.set_option(Idle(2), ignored);
        socket_.set_option(Interval(1), ignored);
        socket_.set_option(Count(3), ignored);
    }

    std::string name_;
    asio::io_context context_;
    tcp::socket socket_;
};

}  // namespace

std::unique_ptr<ByteSource> open_tcp_client(const LidarConfig& config) {
    return std::make_unique<TcpClient>(config);
}

}  // namespace hybrid_slam
