// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include "hybrid_slam/core/error.hpp"
#include "mjpeg_stream.hpp"
#include "mjpeg_url.hpp"
#include "pieces.hpp"

namespace {

using namespace hybrid_slam;  // NOLINT
using fuzz::require;

struct Read {
    std::vector<EncodedImage> images;
    std::string error;
};

Read read(std::string_view bytes, bool whole) {
    MjpegStream stream;
    Read result;
    const auto take = [&](std::string_view piece) { stream.push(piece); };
    try {
        if (whole) {
            take(bytes);
        } else {
            fuzz::in_pieces(bytes, take);
        }
    } catch (const Error& error) {
        result.error = error.what();
        require(!result.error.empty() && result.error.size() < 300);
    }
    while (auto image = stream.next()) {
        require(image->size() >= 4 && image->front() == 0xFF && (*image)[1] == 0xD8);
        result.images.push_back(std::move(*image));
    }
    return result;
}

void check_stream(const std::string& bytes) {
    const Read whole = read(bytes, true);
    const Read piecewise = read(bytes, false);
    require(whole.error == piecewise.error && whole.images == piecewise.images);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string bytes(data, data + size);
    check_stream(bytes);
    // A fuzzer finds the head, but spends its time better behind it.
    check_stream("HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=b\r\n\r\n" +
                 bytes);
    check_stream(
        "HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=b\r\n"
        "Transfer-Encoding: chunked\r\n\r\n" +
        bytes);
    try {
        const MjpegUrl url = parse_mjpeg_url("http://" + bytes);
        require(!url.host.empty() && url.port > 0 && url.path.front() == '/');
        require(url.path.find_first_of(" \r\n") == std::string::npos);
        require(url.request().find("\r\n\r\n") == url.request().size() - 4);
    } catch (const Error&) {
        return 0;
    }
    return 0;
}
