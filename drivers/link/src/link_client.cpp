// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/link/link_client.hpp"

#include <algorithm>
#include <asio/io_context.hpp>
#include <asio/post.hpp>
#include <asio/steady_timer.hpp>
#include <exception>
#include <thread>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/link/codec.hpp"
#include "mailbox.hpp"
#include "session.hpp"
#include "socket_options.hpp"

namespace hybrid_slam {
namespace {

LinkClientConfig checked(LinkClientConfig config) {
    ConfigSchema schema;
    describe(schema, config);  // throws for values out of their ranges
    if (config.retry_most < config.retry_least) {
        throw Error("retry_most: must not be less than retry_least");
    }
    return config;
}

Session::Setup setup_of(const LinkClientConfig& config, LinkRole role) {
    Session::Setup setup;
    setup.server = parse_endpoint(config.server);
    if (setup.server.port == 0) {
        throw Error(config.server + ": the port must not be 0");
    }
    setup.hello =
        encode_json(ClientMessage(LinkHello{role, kLinkVersion, config.token, config.name}));
    setup.patience = config.patience;
    setup.stale_after = config.stale_after;
    return setup;
}

}  // namespace

struct LinkClient::Impl {
    Impl(const LinkClientConfig& client_config, LinkRole role)
        : config(checked(client_config)),
          setup(setup_of(config, role)),
          retry(config.retry_least),
          pause(context),
          thread([this] { run(); }) {}

    ~Impl() {
        context.stop();
        thread.join();
        session.reset();  // its socket needs the context
    }

    void run() {
        attempt();
        while (!context.stopped()) {
            try {
                context.run();
            } catch (const std::exception&) {
                continue;  // no memory, at worst, for what one handler was to do
            }
        }
    }

    void attempt() {
        session = std::make_shared<Session>(context, setup, mailbox,
                                            [this](bool was_welcome) { retry_later(was_welcome); });
        session->start();
    }

    void retry_later(bool was_welcome) {
        retry = was_welcome ? config.retry_least : retry;
        pause.expires_after(nanoseconds(retry));
        retry = std::min(2.0 * retry, config.retry_most);
        pause.async_wait([this](std::error_code) { attempt(); });
    }

    void wake() {
        asio::post(context, [this] { session->pump(); });
    }

    bool send_order(const ClientMessage& message) {
        if (!mailbox.put_order(encode_json(message))) {
            return false;
        }
        wake();
        return true;
    }

    LinkClientConfig config;
    Session::Setup setup;
    Mailbox mailbox;
    double retry;  ///< s until the next attempt
    asio::io_context context{1};
    asio::steady_timer pause;
    std::shared_ptr<Session> session;
    std::thread thread;
};

LinkClient::LinkClient(const LinkClientConfig& config, LinkRole role)
    : impl_(std::make_unique<Impl>(config, role)) {}

LinkClient::~LinkClient() = default;

void LinkClient::send(const LinkPose& pose) {
    try {
        impl_->mailbox.put_pose(encode_json(ClientMessage(pose)), steady_seconds());
    } catch (const Error&) {
        impl_->mailbox.put_invalid_pose();
        return;
    }
    impl_->wake();
}

bool LinkClient::send(const LinkGoals& goals) {
    return impl_->send_order(goals);
}

bool LinkClient::send(LinkCommand command) {
    return impl_->send_order(command);
}

bool LinkClient::send(const LinkInitialPose& pose) {
    return impl_->send_order(pose);
}

bool LinkClient::wait_connected(double timeout) {
    return impl_->mailbox.wait_connected(timeout);
}

std::vector<ServerMessage> LinkClient::received(double timeout) {
    return impl_->mailbox.take_received(timeout);
}

LinkClientReport LinkClient::report() const {
    return impl_->mailbox.report();
}

}  // namespace hybrid_slam
