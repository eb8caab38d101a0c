// SPDX-License-Identifier: Apache-2.0
#include "multipart_reader.hpp"

#include <algorithm>

#include "http_head.hpp"
#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr std::size_t kMostBlanks = 64;  // behind a boundary

bool is_jpeg(std::string_view bytes) {
    return bytes.size() >= 4 && bytes.substr(0, 2) == "\xFF\xD8";
}

}  // namespace

MultipartReader::MultipartReader(std::string_view boundary) {
    const std::size_t dashes = boundary.find_first_not_of('-');
    if (dashes == std::string_view::npos) {
        throw Error("names no boundary between its images");
    }
    boundary_ = "--" + std::string(boundary.substr(dashes));
}

void MultipartReader::push(std::string_view bytes) {
    buffer_.append(bytes);
    while (step()) {
    }
    if (buffer_.size() > kMostMjpegImage + kMostHttpHead) {
        throw Error("sends no boundary between images");
    }
}

std::optional<EncodedImage> MultipartReader::next() {
    if (images_.empty()) {
        return std::nullopt;
    }
    EncodedImage image = std::move(images_.front());
    images_.pop_front();
    return image;
}

/// False when more bytes are needed.
bool MultipartReader::step() {
    switch (state_) {
        case State::kBoundary:
            return read_boundary();
        case State::kHead:
            return read_head();
        case State::kBody:
            return read_body();
        default:
            buffer_.clear();
            return false;
    }
}

bool MultipartReader::read_boundary() {
    Line line;
    if (find_boundary(line) != Search::kFound) {
        return false;
    }
    pass(line);
    return true;
}

bool MultipartReader::read_head() {
    std::size_t end = 0;
    if (buffer_.compare(0, 1, "\n") == 0) {  // a part that says nothing of itself
        end = 1;
    } else if (buffer_.compare(0, 2, "\r\n") == 0) {
        end = 2;
    } else {
        end = end_of_head(std::string_view(buffer_).substr(0, kMostHttpHead));
    }
    if (end == 0) {
        if (buffer_.size() < kMostHttpHead) {
            return false;
        }
        ++skipped_;
        state_ = State::kBoundary;
        return true;
    }
    const HttpHead head(std::string_view(buffer_).substr(0, end));
    const std::string type = lowered(head["content-type"]);
    jpeg_ = type.empty() || type.compare(0, 10, "image/jpeg") == 0 ||
            type.compare(0, 9, "image/jpg") == 0;
    length_ = parse_count(head["content-length"], 10, kMostMjpegImage);
    drop(end);
    state_ = State::kBody;
    return true;
}

bool MultipartReader::read_body() {
    Line line;
    const bool found = find_boundary(line) == Search::kFound;
    // A whole boundary within the part: the rest of the image was lost on its way. (One across its
    // end is of a camera that counts the line break to the image.)
    const bool torn = found && length_ && line.end <= *length_;
    if (length_ && !torn) {
        if (buffer_.size() < *length_) {
            return false;
        }
        take(*length_);
        drop(*length_);
        state_ = State::kBoundary;
        return true;
    }
    if (!found) {
        return false;
    }
    if (torn) {
        ++skipped_;
    } else {
        take(line.begin);
    }
    pass(line);
    return true;
}

/// Of the first boundary in buffer_.
MultipartReader::Search MultipartReader::find_boundary(Line& line) {
    for (std::size_t at = buffer_.find(boundary_, seen_); at != std::string::npos;
         at = buffer_.find(boundary_, at + 1)) {
        const Search how = match(at, line);
        if (how != Search::kNone) {
            seen_ = at;
            return how;
        }
    }
    seen_ = buffer_.size() - std::min(buffer_.size(), boundary_.size() - 1);
    return Search::kNone;
}

/// Whether `at`, where the boundary's text is, is a line of it.
MultipartReader::Search MultipartReader::match(std::size_t at, Line& line) const {
    while (at > 0 && buffer_[at - 1] == '-') {
        --at;
    }
    if (at > 0 && buffer_[at - 1] != '\n') {
        return Search::kNone;
    }
    line.begin = at;
    for (const char c : {'\n', '\r'}) {
        line.begin -= line.begin > 0 && buffer_[line.begin - 1] == c ? 1 : 0;
    }
    std::size_t end = buffer_.find(boundary_, at) + boundary_.size();
    if (buffer_.compare(end, 2, "--") == 0) {
        line.end = end + 2;
        line.last = true;
        return Search::kFound;
    }
    const std::size_t most = end + kMostBlanks;
    while (end < buffer_.size() && end < most &&
           std::string_view(" \t\r").find(buffer_[end]) != std::string_view::npos) {
        ++end;
    }
    if (end == buffer_.size() || (end + 1 == buffer_.size() && buffer_[end] == '-')) {
        return Search::kCut;
    }
    line.end = end + 1;
    line.last = false;
    return buffer_[end] == '\n' ? Search::kFound : Search::kNone;
}

void MultipartReader::pass(const Line& line) {
    drop(line.end);
    state_ = line.last ? State::kEnded : State::kHead;
}

void MultipartReader::drop(std::size_t bytes) {
    buffer_.erase(0, bytes);
    seen_ = 0;
}

/// The first bytes of buffer_ as an image.
void MultipartReader::take(std::size_t bytes) {
    const std::string_view image = std::string_view(buffer_).substr(0, bytes);
    if (!jpeg_ || !is_jpeg(image)) {
        ++skipped_;
        return;
    }
    images_.emplace_back(image.begin(), image.end());
}

}  // namespace hybrid_slam
