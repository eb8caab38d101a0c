// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/link/link_server.hpp"

#include <asio/ip/tcp.hpp>
#include <asio/post.hpp>
#include <utility>

#include "connection.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/link/codec.hpp"
#include "io/tcp_server.hpp"

namespace hybrid_slam {
namespace {

using asio::ip::tcp;

/// Connections beyond the clients: those that have not said who they are, or are being told no.
constexpr std::size_t kMostStrangers = 32;

LinkServerConfig checked(LinkServerConfig config) {
    ConfigSchema schema;
    describe(schema, config);  // throws for values out of their ranges
    if (config.token.find_first_of(" \t\r\n") != std::string::npos || config.token == "-") {
        throw Error("token: must be one word");  // the text form could not say it
    }
    return config;
}

}  // namespace

struct LinkServer::Impl {
    explicit Impl(const LinkServerConfig& config)
        : shared(checked(config)),
          server(parse_endpoint(shared.config.listen),
                 [this](tcp::socket socket) { take(std::move(socket)); }) {}

    ~Impl() {
        server.stop();
        shared.connections.clear();
    }

    void take(tcp::socket socket) {
        const auto admitted = static_cast<std::size_t>(shared.admitted);
        if (shared.connections.size() - admitted >= kMostStrangers) {
            shared.count([](LinkServerCounts& counts) { ++counts.turned_away; });
            // The one that has been silent for the longest; who has something to say says it.
            for (const auto& [id, connection] : shared.connections) {
                if (connection->is_stranger()) {
                    const std::shared_ptr<Connection> silent = connection;
                    silent->drop();
                    break;
                }
            }
            if (shared.connections.size() - admitted >= kMostStrangers) {
                return;  // all of them are on their way out
            }
        }
        const std::uint64_t id = ++last_id;
        const auto connection = std::make_shared<Connection>(std::move(socket), id, shared);
        shared.connections.emplace(id, connection);
        connection->start();
    }

    void publish(StatusLines lines) {
        shared.last_status = std::move(lines);
        for (const auto& each : shared.connections) {
            each.second->publish(shared.last_status);
        }
    }

    ServerShared shared;
    std::uint64_t last_id = 0;
    TcpServer server;  // last: everything else is there when its thread begins
};

LinkServer::LinkServer(const LinkServerConfig& config) : impl_(std::make_unique<Impl>(config)) {}

LinkServer::~LinkServer() = default;

Endpoint LinkServer::endpoint() const {
    return impl_->server.endpoint();
}

std::vector<LinkEvent> LinkServer::events(double timeout) {
    return impl_->shared.events.take(timeout);
}

void LinkServer::publish(const LinkStatus& status) {
    const ServerMessage message = status;
    StatusLines lines;
    lines.json = std::make_shared<const std::string>(encode_json(message) + "\n");
    lines.text = std::make_shared<const std::string>(encode_text(message) + "\n");
    asio::post(impl_->server.context(), [impl = impl_.get(), lines = std::move(lines)]() mutable {
        impl->publish(std::move(lines));
    });
}

void LinkServer::publish(const LinkInitialPose& pose) {
    const ServerMessage message = pose;
    encode_json(message);  // throws here, where the caller hears it
    asio::post(impl_->server.context(), [impl = impl_.get(), message] {
        for (const auto& each : impl->shared.connections) {
            each.second->tell_source(message);
        }
    });
}

void LinkServer::refuse(std::uint64_t client, const std::string& reason) {
    asio::post(impl_->server.context(), [impl = impl_.get(), client, reason] {
        const auto found = impl->shared.connections.find(client);
        if (found != impl->shared.connections.end()) {
            found->second->object(reason);
        }
    });
}

LinkServerCounts LinkServer::counts() const {
    LinkServerCounts counts;
    impl_->shared.count([&counts](LinkServerCounts& current) { counts = current; });
    counts.poses_dropped = impl_->shared.events.poses_dropped();
    return counts;
}

}  // namespace hybrid_slam
