// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>

namespace hybrid_slam {

/// Cuts a stream of bytes into lines, with LF or CR LF at their ends.
class LineBuffer {
  public:
    explicit LineBuffer(std::size_t most_bytes) : most_bytes_(most_bytes) {}

    void append(const char* bytes, std::size_t count) {
        pending_.erase(0, begin_);
        begin_ = 0;
        pending_.append(bytes, count);
    }

    /// False when no whole line is there; for ever, once a line is too long.
    bool next(std::string& line) {
        const std::size_t end = pending_.find('\n', begin_);
        const std::size_t length = std::min(end, pending_.size()) - begin_;
        is_overlong_ = is_overlong_ || length > most_bytes_;
        if (is_overlong_ || end == std::string::npos) {
            return false;
        }
        line.assign(pending_, begin_, length);
        if (!line.empty() && line.back() == '\r') {
            line.pop_back();
        }
        begin_ = end + 1;
        return true;
    }

    bool is_overlong() const { return is_overlong_; }

  private:
    std::size_t most_bytes_;
    std::string pending_;
    std::size_t begin_ = 0;  ///< of the next line
    bool is_overlong_ = false;
};

}  // namespace hybrid_slam
