// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <asio/ip/tcp.hpp>
#include <asio/steady_timer.hpp>
#include <atomic>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "hybrid_slam/camera/mjpeg_server.hpp"

namespace hybrid_slam {

/// What the readers of one MjpegServer have in common.
struct MjpegShared {
    explicit MjpegShared(bool every_image) : lossless(every_image) {}

    template <typename Change>
    void count(Change&& change) {
        const std::lock_guard lock(mutex);
        change(counts);
    }

    const bool lossless;
    std::atomic<int> streaming{0};

  private:
    std::mutex mutex;
    MjpegServerCounts counts;
};

/// One connection of an MjpegServer, used by its thread only: takes the request, then sends images
/// until the other end goes.
class MjpegConnection : public std::enable_shared_from_this<MjpegConnection> {
  public:
    using Image = std::shared_ptr<const EncodedImage>;

    /// `leave` is called once, when the connection is done with; not by the destructor.
    MjpegConnection(asio::ip::tcp::socket socket, MjpegShared& shared, std::function<void()> leave);
    ~MjpegConnection();
    MjpegConnection(const MjpegConnection&) = delete;
    MjpegConnection& operator=(const MjpegConnection&) = delete;

    void start();
    /// Nothing before the request has come.
    void publish(const Image& image);

  private:
    void read_request();
    void answer(const std::string& request);
    void refuse(const std::string& status);
    void send_head();
    void send_next();
    void sent(std::error_code error);
    void watch_for_end();
    void close();

    asio::ip::tcp::socket socket_;
    asio::steady_timer patience_;  ///< for the request
    MjpegShared& shared_;
    std::function<void()> leave_;
    std::string request_;
    std::array<char, 1024> unread_{};
    bool streaming_ = false;
    bool busy_ = false;         ///< a write is under way
    std::deque<Image> images_;  ///< to be sent
    std::size_t bytes_ = 0;     ///< of images_
    Image sending_;
    std::string head_;
};

}  // namespace hybrid_slam
