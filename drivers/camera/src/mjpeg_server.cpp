// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/camera/mjpeg_server.hpp"

#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/post.hpp>
#include <asio/steady_timer.hpp>
#include <chrono>
#include <exception>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "mjpeg_connection.hpp"

namespace hybrid_slam {
namespace {

using asio::ip::tcp;

constexpr std::size_t kMostReaders = 16;
constexpr auto kAcceptPause = std::chrono::milliseconds(100);  // when out of sockets

tcp::acceptor listen(asio::io_context& context, const MjpegServerOptions& options) {
    const std::string name = options.host + ":" + std::to_string(options.port);
    std::error_code error;
    const asio::ip::address address = asio::ip::make_address(options.host, error);
    if (error) {
        throw Error(name + ": the host must be an address of this computer, as 127.0.0.1");
    }
    const tcp::endpoint endpoint(address, options.port);
    tcp::acceptor acceptor(context);
    acceptor.open(endpoint.protocol(), error);
    if (!error) {
        acceptor.set_option(tcp::acceptor::reuse_address(true), error);
        acceptor.bind(endpoint, error);
    }
    if (!error) {
        acceptor.listen(tcp::acceptor::max_listen_connections, error);
    }
    if (error) {
        throw Error(name + ": cannot listen: " + error.message());
    }
    return acceptor;
}

std::string url_of(const tcp::acceptor& acceptor) {
    std::error_code ignored;
    const tcp::endpoint local = acceptor.local_endpoint(ignored);
    std::string host = local.address().to_string();
    if (local.address().is_unspecified()) {
        host = local.address().is_v6() ? "::1" : "127.0.0.1";
    }
    if (host.find(':') != std::string::npos) {
        host = "[" + host + "]";
    }
    return "http://" + host + ":" + std::to_string(local.port()) + "/stream";
}

}  // namespace

struct MjpegServer::Impl {
    explicit Impl(const MjpegServerOptions& options)
        : shared(options.lossless),
          acceptor(listen(context, options)),
          url(url_of(acceptor)),
          pause(context),
          thread([this] { run(); }) {}

    ~Impl() {
        context.stop();
        thread.join();
        readers.clear();  // their sockets need the context
    }

    void run() {
        accept();
        while (!context.stopped()) {
            try {
                context.run();
            } catch (const std::exception&) {
                // No memory, at worst, for what one handler was to do: the next ones may have it.
                continue;
            }
        }
    }

    void accept() {
        acceptor.async_accept([this](std::error_code error, tcp::socket socket) {
            if (error) {
                pause.expires_after(kAcceptPause);
                pause.async_wait([this](std::error_code) { accept(); });
                return;
            }
            accept();
            take(std::move(socket));
        });
    }

    void take(tcp::socket socket) {
        if (readers.size() >= kMostReaders) {
            shared.count([](MjpegServerCounts& counts) { ++counts.refused; });
            return;
        }
        const std::uint64_t id = ++last_id;
        const auto reader = std::make_shared<MjpegConnection>(std::move(socket), shared,
                                                              [this, id] { readers.erase(id); });
        readers.emplace(id, reader);
        reader->start();
    }

    MjpegShared shared;
    asio::io_context context{1};
    tcp::acceptor acceptor;
    std::string url;
    asio::steady_timer pause;
    std::map<std::uint64_t, std::shared_ptr<MjpegConnection>> readers;
    std::uint64_t last_id = 0;
    std::thread thread;
};

MjpegServer::MjpegServer(const MjpegServerOptions& options)
    : impl_(std::make_unique<Impl>(options)) {}

MjpegServer::~MjpegServer() = default;

std::string MjpegServer::url() const {
    return impl_->url;
}

void MjpegServer::publish(EncodedImage jpeg) {
    impl_->shared.count([](MjpegServerCounts& counts) { ++counts.images; });
    asio::post(impl_->context,
               [impl = impl_.get(), image = std::make_shared<const EncodedImage>(std::move(jpeg))] {
                   const auto readers = impl->readers;  // of which one may leave meanwhile
                   for (const auto& each : readers) {
                       each.second->publish(image);
                   }
               });
}

bool MjpegServer::has_reader() const {
    return impl_->shared.streaming > 0;
}

MjpegServerCounts MjpegServer::counts() const {
    MjpegServerCounts counts;
    impl_->shared.count([&counts](MjpegServerCounts& current) { counts = current; });
    return counts;
}

}  // namespace hybrid_slam
