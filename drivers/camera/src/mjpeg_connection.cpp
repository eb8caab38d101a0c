// SPDX-License-Identifier: Apache-2.0
#include "mjpeg_connection.hpp"

#include <asio/buffer.hpp>
#include <asio/read_until.hpp>
#include <asio/write.hpp>
#include <chrono>
#include <string_view>
#include <utility>

namespace hybrid_slam {
namespace {

using asio::ip::tcp;

constexpr std::size_t kMostRequest = 8192;  // bytes
constexpr auto kRequestPatience = std::chrono::seconds(5);
/// Of a lossless stream, when its reader has stopped taking: it is lost then, not the memory.
constexpr std::size_t kMostQueued = std::size_t{256} << 20U;
/// What the system may hold of a stream: an image or two, since they would be old ones.
constexpr int kSendBuffer = 128 * 1024;

constexpr std::string_view kBoundary = "next-image";

std::string part_head(std::size_t bytes) {
    return "Content-Type: image/jpeg\r\nContent-Length: " + std::to_string(bytes) + "\r\n\r\n";
}

}  // namespace

MjpegConnection::MjpegConnection(tcp::socket socket, MjpegShared& shared,
                                 std::function<void()> leave)
    : socket_(std::move(socket)),
      patience_(socket_.get_executor()),
      shared_(shared),
      leave_(std::move(leave)) {}

MjpegConnection::~MjpegConnection() {
    if (streaming_) {
        --shared_.streaming;
    }
}

void MjpegConnection::start() {
    std::error_code ignored;
    socket_.set_option(tcp::no_delay(true), ignored);
    if (!shared_.lossless) {
        socket_.set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
    }
    patience_.expires_after(kRequestPatience);
    patience_.async_wait([self = shared_from_this()](std::error_code error) {
        if (!error && !self->streaming_) {
            self->close();
        }
    });
    read_request();
}

void MjpegConnection::read_request() {
    asio::async_read_until(socket_, asio::dynamic_buffer(request_, kMostRequest), "\r\n\r\n",
                           [self = shared_from_this()](std::error_code error, std::size_t) {
                               if (!self->socket_.is_open()) {
                                   return;
                               }
                               if (error) {  // gone, or more than a request has to say
                                   self->close();
                                   return;
                               }
                               self->answer(self->request_);
                           });
}

void MjpegConnection::answer(const std::string& request) {
    const std::string_view line(request.data(), request.find("\r\n"));
    if (line.substr(0, 4) != "GET ") {
        refuse("405 Method Not Allowed");
        return;
    }
    const std::string_view path = line.substr(4, line.find(' ', 4) - 4);
    if (path != "/" && path.substr(0, path.find('?')) != "/stream") {
        refuse("404 Not Found");
        return;
    }
    send_head();
}

void MjpegConnection::refuse(const std::string& status) {
    shared_.count([](MjpegServerCounts& counts) { ++counts.refused; });
    head_ = "HTTP/1.1 " + status +
            "\r\nConnection: close\r\nContent-Type: text/plain\r\nContent-Length: 24\r\n\r\n"
            "the camera is at /stream";
    asio::async_write(socket_, asio::buffer(head_),
                      [self = shared_from_this()](std::error_code, std::size_t) { self->close(); });
}

void MjpegConnection::send_head() {
    patience_.cancel();
    streaming_ = true;
    ++shared_.streaming;
    shared_.count([](MjpegServerCounts& counts) { ++counts.readers; });
    head_ =
        "HTTP/1.1 200 OK\r\nConnection: close\r\nCache-Control: no-store\r\n"
        "Content-Type: multipart/x-mixed-replace; boundary=" +
        std::string(kBoundary) + "\r\n";
    if (shared_.lossless) {
        head_ += "X-Every-Image: yes\r\n";
    }
    // The boundary goes out behind an image, not before the next, so that no reader has to wait
    // for the next to know that this one is whole.
    head_ += "\r\n--" + std::string(kBoundary) + "\r\n";
    busy_ = true;
    asio::async_write(
        socket_, asio::buffer(head_),
        [self = shared_from_this()](std::error_code error, std::size_t) { self->sent(error); });
    watch_for_end();
}

void MjpegConnection::publish(const Image& image) {
    if (!streaming_ || !socket_.is_open()) {
        return;
    }
    if (!shared_.lossless && !images_.empty()) {
        shared_.count([](MjpegServerCounts& counts) { ++counts.dropped; });
        images_.clear();
        bytes_ = 0;
    }
    images_.push_back(image);
    bytes_ += image->size();
    if (bytes_ > kMostQueued) {
        close();
        return;
    }
    if (!busy_) {
        send_next();
    }
}

void MjpegConnection::send_next() {
    sending_ = std::move(images_.front());
    images_.pop_front();
    bytes_ -= sending_->size();
    head_ = part_head(sending_->size());
    static const std::string kEnd = "\r\n--" + std::string(kBoundary) + "\r\n";
    const std::array<asio::const_buffer, 3> part = {asio::buffer(head_), asio::buffer(*sending_),
                                                    asio::buffer(kEnd)};
    busy_ = true;
    asio::async_write(socket_, part,
                      [self = shared_from_this()](std::error_code error, std::size_t) {
                          if (!error) {
                              self->shared_.count([](MjpegServerCounts& counts) { ++counts.sent; });
                          }
                          self->sent(error);
                      });
}

void MjpegConnection::sent(std::error_code error) {
    busy_ = false;
    sending_.reset();
    if (!socket_.is_open()) {
        return;
    }
    if (error) {
        close();
        return;
    }
    if (!images_.empty()) {
        send_next();
    }
}

/// A reader that leaves while there are no images would be counted on otherwise.
void MjpegConnection::watch_for_end() {
    socket_.async_read_some(asio::buffer(unread_),
                            [self = shared_from_this()](std::error_code error, std::size_t) {
                                if (!self->socket_.is_open()) {
                                    return;
                                }
                                if (error) {
                                    self->close();
                                    return;
                                }
                                self->watch_for_end();
                            });
}

void MjpegConnection::close() {
    if (!socket_.is_open()) {
        return;
    }
    patience_.cancel();
    std::error_code ignored;
    socket_.shutdown(tcp::socket::shutdown_both, ignored);
    socket_.close(ignored);
    if (streaming_) {
        streaming_ = false;
        --shared_.streaming;
    }
    leave_();
}

}  // namespace hybrid_slam
