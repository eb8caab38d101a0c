// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/link/raw_socket.hpp"
#include "drivers/live/streams.hpp"
#include "hybrid_slam/camera/capture.hpp"

namespace hybrid_slam::test {

/// Begins and ends as a JPEG does and tells its number; the rest is bytes of all kinds.
inline EncodedImage numbered_image(std::uint32_t number, std::size_t size = 300) {
    EncodedImage image = {0xFF, 0xD8};
    for (int shift = 24; shift >= 0; shift -= 8) {
        image.push_back(static_cast<std::uint8_t>(number >> shift));
    }
    while (image.size() + 2 < size) {
        image.push_back(static_cast<std::uint8_t>(image.size() * 31 + number));
    }
    image.push_back(0xFF);
    image.push_back(0xD9);
    return image;
}

inline std::uint32_t number_of(const EncodedImage& image) {
    std::uint32_t number = 0;
    for (std::size_t i = 2; i < 6; ++i) {
        number = number << 8U | image.at(i);
    }
    return number;
}

inline std::string text_of(const EncodedImage& image) {
    return {image.begin(), image.end()};
}

constexpr char kStreamHead[] =
    "HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=frame\r\n\r\n--frame\r\n";

/// With a Content-Length and the boundary behind it.
inline std::string part(const EncodedImage& image) {
    return "Content-Type: image/jpeg\r\nContent-Length: " + std::to_string(image.size()) +
           "\r\n\r\n" + text_of(image) + "\r\n--frame\r\n";
}

/// A network camera with one customer at a time that does what the test says.
class FakeCamera {
  public:
    using Play = std::function<void(RawSocket&)>;

    /// `play` gets each customer, once its request has come; the connection ends with it.
    explicit FakeCamera(Play play, int customers = 1)
        : listener_(RawSocket::listen()), thread_([this, play = std::move(play), customers] {
              for (int i = 0; i < customers; ++i) {
                  RawSocket customer = listener_.accept();
                  request_.clear();
                  for (auto line = customer.line(); line && *line != "\r"; line = customer.line()) {
                      request_ += *line + "\n";
                  }
                  play(customer);
              }
          }) {}
    ~FakeCamera() { join(); }
    FakeCamera(const FakeCamera&) = delete;
    FakeCamera& operator=(const FakeCamera&) = delete;

    void join() {
        if (thread_.joinable()) {
            thread_.join();
        }
    }
    /// Of the last customer; after `join`.
    const std::string& request() const { return request_; }

    std::string address() const { return "127.0.0.1:" + std::to_string(listener_.port()); }
    std::string url() const { return "http://" + address() + "/cam"; }

  private:
    RawSocket listener_;
    std::string request_;
    std::thread thread_;
};

inline std::unique_ptr<Capture> open_url(const std::string& url) {
    CameraConfig config;
    config.device = url;
    return open_capture(config);
}

/// The numbers of all images until the connection ends.
inline std::vector<std::uint32_t> numbers_to_the_end(Capture& capture) {
    std::vector<std::uint32_t> numbers;
    EncodedImage image;
    try {
        while (capture.read(image, kLongWait)) {
            numbers.push_back(number_of(image));
        }
    } catch (const std::exception&) {
        return numbers;
    }
    return numbers;
}

}  // namespace hybrid_slam::test
