// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "hybrid_slam/camera/image_codec.hpp"
#include "multipart_reader.hpp"

namespace hybrid_slam {

/// Takes the chunked transfer encoding off (RFC 9112, 7.1).
class ChunkReader {
  public:
    /// Appends the contents to `body`. Throws Error for what is no chunk.
    void push(std::string_view bytes, std::string& body);
    bool ended() const { return state_ == State::kEnded; }

  private:
    enum class State { kSize, kBody, kBodyEnd, kEnded };

    void start_chunk();

    State state_ = State::kSize;
    std::string line_;
    std::size_t left_ = 0;
};

/// What a network camera sends, from the first byte of its answer on. No sockets in here.
class MjpegStream {
  public:
    /// Throws Error for an answer that is no stream of images, and when it ended.
    void push(std::string_view bytes);

    /// The images that are whole, in order.
    std::optional<EncodedImage> next();

    bool begun() const { return parts_.has_value(); }  ///< the header came, and is good
    bool every_image() const { return every_image_; }  ///< none is to be left out
    std::uint64_t skipped() const { return parts_ ? parts_->skipped() : 0; }

  private:
    void read_head();
    void take(std::string_view body);

    std::string head_;
    bool every_image_ = false;
    std::optional<ChunkReader> chunks_;
    std::optional<MultipartReader> parts_;
};

}  // namespace hybrid_slam
