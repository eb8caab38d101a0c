// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "hybrid_slam/camera/image_codec.hpp"

namespace hybrid_slam {

struct MjpegServerOptions {
    std::uint16_t port = 0;          ///< 0: any that is free
    std::string host = "127.0.0.1";  ///< the address to listen at; 0.0.0.0: all
    /// Every image for every reader, in order, for a simulation in lockstep. The answer's header
    /// says so (X-Every-Image: yes), upon which open_capture leaves none out either.
    bool lossless = false;
};

struct MjpegServerCounts {
    std::uint64_t readers = 0;  ///< that were let in, ever
    std::uint64_t refused = 0;  ///< requests that were not for the stream, and readers too many
    std::uint64_t images = 0;   ///< published
    std::uint64_t sent = 0;     ///< to a reader, wholly handed to the system
    std::uint64_t dropped = 0;  ///< for a reader that had not taken the one before yet
};

/// A network camera: JPEG images over HTTP as multipart/x-mixed-replace, which browsers show and
/// open_capture reads. One thread of its own. A reader that is slow misses images and gets the
/// newest next; a new one gets the first that is published after it came. Methods may be called
/// from any thread.
class MjpegServer {
  public:
    /// Listens when it returns. Throws Error for an address that cannot be had.
    explicit MjpegServer(const MjpegServerOptions& options = {});
    /// Closes all connections: the cable is pulled. Another one may have the same port at once.
    ~MjpegServer();
    MjpegServer(const MjpegServer&) = delete;
    MjpegServer& operator=(const MjpegServer&) = delete;

    /// http://host:port/stream, for CameraConfig::device; 127.0.0.1 when listening to all.
    std::string url() const;

    /// To all readers. Never blocks.
    void publish(EncodedImage jpeg);

    bool has_reader() const;
    MjpegServerCounts counts() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace hybrid_slam
