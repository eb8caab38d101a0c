// SPDX-License-Identifier: Apache-2.0
#include "mjpeg_stream.hpp"

#include <algorithm>

#include "http_head.hpp"
#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr char kEnded[] = "ended the stream";

/// In words for who set up the camera, who may have made a slip.
void check_status(const HttpHead& head) {
    if (head.first.compare(0, 5, "HTTP/") != 0) {
        throw Error("what answers there does not speak HTTP");
    }
    const std::size_t blank = head.first.find(' ');
    const std::string status = blank == std::string::npos ? "" : head.first.substr(blank + 1);
    const std::string code = status.substr(0, 3);
    if (code == "200") {
        return;
    }
    if (code == "401") {
        const bool digest = lowered(head["www-authenticate"]).compare(0, 6, "digest") == 0;
        throw Error(digest ? "asks for digest authentication, which is not spoken here"
                           : "wants a user and password: http://user:password@host/...");
    }
    if (code.size() == 3 && code[0] == '3') {
        throw Error("sends elsewhere: " + head["location"].substr(0, 200));
    }
    throw Error("answers: " + status.substr(0, 100));
}

/// The boundary in the Content-Type.
std::string boundary_of(const std::string& type) {
    if (lowered(type).compare(0, 10, "multipart/") != 0) {
        throw Error("gives " + (type.empty() ? "something unnamed" : type.substr(0, 100)) +
                    ", not a stream of JPEG images (multipart/x-mixed-replace)");
    }
    const std::size_t at = lowered(type).find("boundary=");
    std::string_view name = at == std::string::npos ? "" : std::string_view(type).substr(at + 9);
    if (!name.empty() && name.front() == '"') {
        name = name.substr(1, name.find('"', 1) - 1);
    } else {
        name = trimmed(name.substr(0, name.find(';')));
    }
    return std::string(name);
}

}  // namespace

void ChunkReader::start_chunk() {
    const std::string_view line(line_);
    const auto size = parse_count(trimmed(line.substr(0, line.find(';'))), 16, kMostMjpegImage * 4);
    if (!size) {
        throw Error("sends chunks without a size");
    }
    line_.clear();
    left_ = *size;
    state_ = left_ > 0 ? State::kBody : State::kEnded;
}

void ChunkReader::push(std::string_view bytes, std::string& body) {
    constexpr std::size_t kMostLine = 256;
    while (!bytes.empty() && state_ != State::kEnded) {
        if (state_ == State::kBody) {
            const std::size_t count = std::min(left_, bytes.size());
            body.append(bytes.substr(0, count));
            bytes.remove_prefix(count);
            left_ -= count;
            state_ = left_ > 0 ? State::kBody : State::kBodyEnd;
            continue;
        }
        const char c = bytes.front();
        bytes.remove_prefix(1);
        if (c != '\n') {
            line_ += c;
        } else if (state_ == State::kSize) {
            start_chunk();
        } else {
            if (!trimmed(line_).empty()) {
                throw Error("sends chunks that are longer than they say");
            }
            line_.clear();
            state_ = State::kSize;
        }
        if (line_.size() > kMostLine) {
            throw Error("sends chunks without a size");
        }
    }
}

void MjpegStream::push(std::string_view bytes) {
    if (!parts_) {
        head_.append(bytes);
        const std::size_t end = end_of_head(head_);
        if (end == 0 && head_.size() <= kMostHttpHead) {
            return;
        }
        if (end == 0 || end > kMostHttpHead) {
            throw Error(head_.compare(0, 5, "HTTP/") == 0
                            ? "the header of its answer does not end"
                            : "what answers there does not speak HTTP");
        }
        const std::string rest = head_.substr(end);
        head_.resize(end);
        read_head();
        push(rest);
        return;
    }
    if (!chunks_) {
        take(bytes);
        return;
    }
    std::string body;
    try {
        chunks_->push(bytes, body);
    } catch (const Error&) {
        take(body);  // what was before the damage is good
        throw;
    }
    take(body);
    if (chunks_->ended()) {
        throw Error(kEnded);
    }
}

void MjpegStream::take(std::string_view body) {
    parts_->push(body);
    if (parts_->ended()) {
        throw Error(kEnded);
    }
}

std::optional<EncodedImage> MjpegStream::next() {
    return parts_ ? parts_->next() : std::nullopt;
}

void MjpegStream::read_head() {
    const HttpHead head(head_);
    check_status(head);
    const std::string boundary = boundary_of(head["content-type"]);
    every_image_ = lowered(head["x-every-image"]) == "yes";
    const std::string coding = lowered(head["transfer-encoding"]);
    if (coding == "chunked") {
        chunks_.emplace();
    } else if (!coding.empty() && coding != "identity") {
        throw Error("sends in the coding " + coding.substr(0, 100) + ", which is not spoken here");
    }
    parts_.emplace(boundary);
    head_.clear();
}

}  // namespace hybrid_slam
