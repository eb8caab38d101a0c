// SPDX-License-Identifier: Apache-2.0
#include <netinet/tcp.h>

#include <array>
#include <asio/buffer.hpp>
#include <asio/connect.hpp>
#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/write.hpp>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "captures.hpp"
#include "hybrid_slam/core/error.hpp"
#include "mjpeg_stream.hpp"
#include "mjpeg_url.hpp"

namespace hybrid_slam {
namespace {

using asio::ip::tcp;

constexpr std::chrono::seconds kConnectTimeout{3};
constexpr std::chrono::seconds kAnswerTimeout{5};
constexpr std::size_t kMostWaiting = 64;  // images, where none is to be left out

/// Runs what was started, for at most `timeout`; false when it was not done by then.
bool run_within(asio::io_context& context, tcp::socket& socket, std::chrono::seconds timeout) {
    context.restart();
    context.run_for(timeout);
    if (context.stopped()) {
        return true;
    }
    std::error_code ignored;
    socket.close(ignored);
    context.run();  // the handler refers to the caller's variables: it must have run
    return false;
}

/// A camera that lost its power would not be missed otherwise: we send nothing.
void notice_dead_peers(tcp::socket& socket) {
    using Idle = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_KEEPIDLE>;
    using Interval = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_KEEPINTVL>;
    using Count = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_KEEPCNT>;
    std::error_code ignored;
    socket.set_option(asio::socket_base::keep_alive(true), ignored);
    socket.set_option(Idle(2), ignored);
    socket.set_option(Interval(1), ignored);
    socket.set_option(Count(3), ignored);
}

/// The connection: blocking to open, then read by one thread.
class Line {
  public:
    explicit Line(const MjpegUrl& url) : socket_(context_) {
        connect(url);
        send(url.request());
        notice_dead_peers(socket_);
        const auto until = std::chrono::steady_clock::now() + kAnswerTimeout;
        while (!stream_.begun()) {
            std::error_code error;
            start_read([&error](std::error_code how) { error = how; });
            const bool done = run_within(context_, socket_, kAnswerTimeout);
            if (!done || std::chrono::steady_clock::now() > until) {
                throw Error("does not answer (is it a camera's stream?)");
            }
            stream_.push(bytes(error));
        }
    }

    MjpegStream& stream() { return stream_; }

    /// The bytes of the read before; Error when the other end is gone.
    std::string_view bytes(std::error_code error) const {
        if (error) {
            const bool closed = error == asio::error::eof;
            throw Error(closed ? "closed by the other end" : error.message());
        }
        return {buffer_.data(), count_};
    }

    template <typename Done>
    void start_read(Done done) {
        socket_.async_read_some(asio::buffer(buffer_),
                                [this, done](std::error_code error, std::size_t count) {
                                    count_ = count;
                                    done(error);
                                });
    }

    /// Waits for bytes, for ever.
    std::string_view read() {
        std::error_code error;
        start_read([&error](std::error_code how) { error = how; });
        context_.restart();
        context_.run();
        return bytes(error);
    }

    /// From another thread; read fails then, at once.
    void hang_up() { ::shutdown(socket_.native_handle(), SHUT_RDWR); }

  private:
    void connect(const MjpegUrl& url) {
        std::error_code error;
        tcp::resolver resolver(context_);
        const auto endpoints = resolver.resolve(url.host, std::to_string(url.port), error);
        if (!error) {
            asio::async_connect(
                socket_, endpoints,
                [&error](const std::error_code& how, const tcp::endpoint&) { error = how; });
            if (!run_within(context_, socket_, kConnectTimeout)) {
                throw Error("no answer (is the camera on, is the address right?)");
            }
        }
        if (error) {
            throw Error(error.message());
        }
    }

    void send(const std::string& request) {
        std::error_code error;
        asio::async_write(socket_, asio::buffer(request),
                          [&error](std::error_code how, std::size_t) { error = how; });
        if (!run_within(context_, socket_, kAnswerTimeout) || error) {
            throw Error(error.message());
        }
    }

    asio::io_context context_{1};
    tcp::socket socket_;
    std::array<char, 65536> buffer_{};
    std::size_t count_ = 0;
    MjpegStream stream_;
};

/// A thread takes all that comes, at once: what would lie in the buffers of both systems while the
/// reader is slow would be old when it is read, and the newest behind all of it.
class MjpegCapture : public Capture {
  public:
    explicit MjpegCapture(const std::string& device)
        : url_(parse_mjpeg_url(device)), line_(connected()), every_(line_->stream().every_image()) {
        thread_ = std::thread([this] { run(); });
    }

    ~MjpegCapture() override {
        {
            const std::lock_guard lock(mutex_);
            leaving_ = true;
        }
        changed_.notify_all();
        line_->hang_up();
        thread_.join();
    }

    bool read(EncodedImage& image, double timeout) override {
        std::unique_lock lock(mutex_);
        changed_.wait_for(lock, std::chrono::duration<double>(timeout),
                          [this] { return !images_.empty() || !error_.empty(); });
        if (images_.empty()) {
            if (!error_.empty()) {
                throw Error(url_.name + ": " + error_);
            }
            return false;
        }
        image = std::move(images_.front());
        images_.pop_front();
        changed_.notify_all();
        return true;
    }

  private:
    std::unique_ptr<Line> connected() const {
        try {
            return std::make_unique<Line>(url_);
        } catch (const Error& error) {
            throw Error(url_.name + ": " + error.what());
        }
    }

    void run() {
        try {
            take_images();
            while (!leaving()) {
                line_->stream().push(line_->read());
                take_images();
            }
        } catch (const std::exception& error) {
            take_images();
            const std::lock_guard lock(mutex_);
            error_ = error.what();
        }
        changed_.notify_all();
    }

    bool leaving() {
        const std::lock_guard lock(mutex_);
        return leaving_;
    }

    void take_images() {
        std::optional<EncodedImage> image = line_->stream().next();
        for (; image; image = line_->stream().next()) {
            std::unique_lock lock(mutex_);
            if (every_) {  // the server waits meanwhile
                changed_.wait(lock, [this] { return images_.size() < kMostWaiting || leaving_; });
            } else {
                images_.clear();
            }
            images_.push_back(std::move(*image));
            changed_.notify_all();
        }
    }

    MjpegUrl url_;
    std::unique_ptr<Line> line_;
    bool every_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<EncodedImage> images_;
    std::string error_;
    bool leaving_ = false;
    std::thread thread_;
};

}  // namespace

std::unique_ptr<Capture> open_mjpeg_capture(const CameraConfig& config) {
    return std::make_unique<MjpegCapture>(config.device);
}

}  // namespace hybrid_slam
