// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/camera/mjpeg_server.hpp"

#include <asio/ip/tcp.hpp>
#include <asio/post.hpp>
#include <map>
#include <utility>

#include "io/tcp_server.hpp"
#include "mjpeg_connection.hpp"

namespace hybrid_slam {
namespace {

using asio::ip::tcp;

constexpr std::size_t kMostReaders = 16;

std::string url_of(Endpoint endpoint) {
    if (endpoint.host == "0.0.0.0") {
        endpoint.host = "127.0.0.1";
    } else if (endpoint.host == "::") {
        endpoint.host = "::1";
    }
    return "http://" + endpoint.text() + "/stream";
}

}  // namespace

struct MjpegServer::Impl {
    explicit Impl(const MjpegServerOptions& options)
        : shared(options.lossless),
          server({options.host, options.port},
                 [this](tcp::socket socket) { take(std::move(socket)); }) {}

    ~Impl() {
        server.stop();
        readers.clear();
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
    std::map<std::uint64_t, std::shared_ptr<MjpegConnection>> readers;
    std::uint64_t last_id = 0;
    TcpServer server;  // last: everything else is there when its thread begins
};

MjpegServer::MjpegServer(const MjpegServerOptions& options)
    : impl_(std::make_unique<Impl>(options)) {}

MjpegServer::~MjpegServer() = default;

std::string MjpegServer::url() const {
    return url_of(impl_->server.endpoint());
}

void MjpegServer::publish(EncodedImage jpeg) {
    impl_->shared.count([](MjpegServerCounts& counts) { ++counts.images; });
    asio::post(impl_->server.context(),
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
