// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>

#include "hybrid_slam/camera/image_codec.hpp"

namespace hybrid_slam {

inline constexpr std::size_t kMostMjpegImage = std::size_t{16} << 20U;  // bytes

/// The images within a multipart body, by Content-Length where parts have it and by the boundary
/// else. Damage costs the image that it hits: reading goes on at the next boundary.
class MultipartReader {
  public:
    /// `boundary` as the header announces it, with dashes before it or without: cameras disagree
    /// with their own headers. Throws Error when it is empty.
    explicit MultipartReader(std::string_view boundary);

    /// Throws Error when no boundary comes for longer than any image is.
    void push(std::string_view bytes);
    std::optional<EncodedImage> next();
    std::uint64_t skipped() const { return skipped_; }      ///< parts that were no image
    bool ended() const { return state_ == State::kEnded; }  ///< by the last boundary

  private:
    enum class State { kBoundary, kHead, kBody, kEnded };
    enum class Search { kNone, kCut, kFound };
    struct Line {
        std::size_t begin = 0;  ///< of the line break before it
        std::size_t end = 0;    ///< behind its own
        bool last = false;      ///< of the whole body
    };

    bool step();
    bool read_boundary();
    bool read_head();
    bool read_body();
    Search find_boundary(Line& line);
    Search match(std::size_t at, Line& line) const;
    void pass(const Line& line);
    void drop(std::size_t bytes);
    void take(std::size_t bytes);

    std::string boundary_;
    State state_ = State::kBoundary;
    std::string buffer_;
    std::size_t seen_ = 0;  ///< bytes of buffer_ in which no boundary begins
    std::optional<std::size_t> length_;
    bool jpeg_ = true;  ///< the part says that it is one, or not what it is
    std::deque<EncodedImage> images_;
    std::uint64_t skipped_ = 0;
};

}  // namespace hybrid_slam
