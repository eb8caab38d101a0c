// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <vector>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/link/codec.hpp"
#include "line_buffer.hpp"
#include "pieces.hpp"

namespace {

using namespace hybrid_slam;  // NOLINT
using fuzz::require;

/// A line is taken or refused with an Error, whose reason goes to the other end as a line.
template <typename Decode, typename Check>
void try_line(const Decode& decode, std::string_view line, const Check& check) {
    std::string reason;
    try {
        const auto message = decode(line);
        // What was taken is fit to be told on.
        check(message);
        return;
    } catch (const Error& error) {
        reason = error.what();
    }
    require(!reason.empty() && reason.size() < 300);
    require(reason.find('\n') == std::string::npos);
}

/// What a decoder takes, the encoder can say, and that means the same.
template <typename Message, typename Decode>
void check_said_again(const Message& message, const Decode& decode) {
    std::string line;
    std::string again;
    try {
        line = encode_json(message);
        again = encode_json(decode(line));
    } catch (const Error&) {
        std::abort();
    }
    require(line == again);
    require(line.find('\n') == std::string::npos);
}

void check_words(const ServerMessage& message) {
    std::string words;
    try {
        words = encode_text(message);
    } catch (const Error&) {
        std::abort();
    }
    require(!words.empty() && words.find('\n') == std::string::npos);
}

void check_line(std::string_view line) {
    try_line(decode_client_json, line,
             [](const ClientMessage& message) { check_said_again(message, decode_client_json); });
    const bool is_ascii = std::all_of(line.begin(), line.end(),
                                      [](char c) { return static_cast<signed char>(c) >= 0; });
    try_line(decode_client_text, line, [is_ascii](const ClientMessage& message) {
        if (is_ascii) {  // JSON replaces what is not UTF-8, which makes it longer
            check_said_again(message, decode_client_json);
        }
    });
    try_line(decode_server_json, line, [](const ServerMessage& message) {
        check_said_again(message, decode_server_json);
        check_words(message);
    });
    is_text_hello(line);
}

constexpr std::size_t kMostBytes = 512;

std::vector<std::string> lines_of(std::string_view bytes, bool whole) {
    LineBuffer buffer(kMostBytes);
    std::vector<std::string> lines;
    std::string line;
    const auto take = [&](std::string_view piece) {
        buffer.append(piece.data(), piece.size());
        while (buffer.next(line)) {
            lines.push_back(line);
        }
    };
    if (whole) {
        take(bytes);
    } else {
        fuzz::in_pieces(bytes, take);
    }
    return lines;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string bytes(data, data + size);
    const std::vector<std::string> lines = lines_of(bytes, true);
    require(lines == lines_of(bytes, false));
    for (const std::string& line : lines) {
        require(line.size() <= kMostBytes && line.find('\n') == std::string::npos);
        check_line(line);
    }
    check_line(bytes);
    return 0;
}
