// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/can/slcan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>

#include "hex.hpp"
#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr char kReturn = '\r';
constexpr char kBell = '\a';
constexpr std::string_view kLineEnds = "\r\a";
constexpr std::size_t kLongestLine = 30;  // T1111222281122334455667788EA5F
constexpr std::uint32_t kLastMillisecond = 0xEA5F;
constexpr std::array<int, 9> kBitRates = {10000,  20000,  50000,  100000, 125000,
                                          250000, 500000, 800000, 1000000};

/// A frame's line without its end; nothing when it is none.
std::optional<SlcanLine> parse_frame(std::string_view text) {
    SlcanLine line;
    line.kind = SlcanLine::Kind::kFrame;
    CanFrame& frame = line.frame;
    frame.extended = text[0] == 'T' || text[0] == 'R';
    frame.remote = text[0] == 'r' || text[0] == 'R';
    const std::size_t id_digits = frame.extended ? 8 : 3;
    if (text.size() < id_digits + 2) {
        return std::nullopt;
    }
    const auto id = parse_hex(text.substr(1, id_digits));
    const auto size = parse_hex(text.substr(id_digits + 1, 1));
    std::string_view rest = text.substr(id_digits + 2);
    const std::size_t data_digits = frame.remote ? 0 : 2 * size.value_or(0);
    if (!id || !size || rest.size() < data_digits ||
        !parse_data(rest.substr(0, data_digits), frame)) {
        return std::nullopt;
    }
    frame.id = *id;
    frame.size = static_cast<std::uint8_t>(*size);
    rest = rest.substr(data_digits);
    const auto stamp = parse_hex(rest);
    const bool stamp_fits = rest.size() == 4 && stamp && *stamp <= kLastMillisecond;
    if (!frame.valid() || (!rest.empty() && !stamp_fits)) {
        return std::nullopt;
    }
    if (stamp_fits) {
        line.milliseconds = static_cast<int>(*stamp);
    }
    return line;
}

/// A command or the answer to one: a letter that has a meaning, and digits.
bool is_text(std::string_view text) {
    constexpr std::string_view kLetters = "SsOLlCVvNFZMmQXUW";
    const auto alphanumeric = [](char c) {
        return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
    };
    return kLetters.find(text[0]) != std::string_view::npos && text.size() <= 10 &&
           std::all_of(text.begin(), text.end(), alphanumeric);
}

std::optional<SlcanLine> parse_line(const std::string& text) {
    SlcanLine line;
    if (text.empty() || text == "z" || text == "Z") {
        return line;
    }
    if (std::string_view("tTrR").find(text[0]) != std::string_view::npos) {
        return parse_frame(text);
    }
    if (!is_text(text)) {
        return std::nullopt;
    }
    line.kind = SlcanLine::Kind::kText;
    line.text = text;
    return line;
}

}  // namespace

std::string to_slcan(const CanFrame& frame) {
    if (!frame.valid()) {
        throw Error(fmt::format("CAN frame {:X}: id or size does not fit", frame.id));
    }
    const char small = frame.remote ? 'r' : 't';
    const char letter = frame.extended ? static_cast<char>(small - 'a' + 'A') : small;
    return letter + to_hex(frame.id, frame.extended ? 8 : 3) + to_hex(frame.size, 1) +
           (frame.remote ? "" : data_to_hex(frame)) + kReturn;
}

std::string slcan_bit_rate(int bit_rate) {
    const auto* const found = std::find(kBitRates.begin(), kBitRates.end(), bit_rate);
    if (found == kBitRates.end()) {
        throw Error(
            fmt::format("bit_rate: SLCAN has {}, not {}", fmt::join(kBitRates, ", "), bit_rate));
    }
    return fmt::format("S{}", std::distance(kBitRates.begin(), found));
}

std::vector<SlcanLine> SlcanParser::push(std::string_view bytes) {
    std::vector<SlcanLine> lines;
    for (const char byte : bytes) {
        if (byte == kBell) {
            // What stands before a bell was cut off by it.
            dropped_ += line_.empty() && !too_long_ ? 0 : 1;
            line_.clear();
            too_long_ = false;
            lines.emplace_back().kind = SlcanLine::Kind::kRefused;
        } else if (byte == kReturn) {
            end_line(lines);
        } else if (line_.size() == kLongestLine) {
            too_long_ = true;
        } else {
            line_ += byte;
        }
    }
    return lines;
}

void SlcanParser::end_line(std::vector<SlcanLine>& lines) {
    std::optional<SlcanLine> line;
    if (!too_long_) {
        line = parse_line(line_);
    }
    if (line) {
        lines.push_back(std::move(*line));
    } else {
        ++dropped_;
    }
    line_.clear();
    too_long_ = false;
}

SlcanAdapter::Result SlcanAdapter::push(std::string_view bytes) {
    Result result;
    // Line by line: a host takes answers for those to its commands in the order that it sent them.
    while (!bytes.empty()) {
        const std::size_t end = bytes.find_first_of(kLineEnds);
        const std::size_t length = std::min(end, bytes.size() - 1) + 1;
        push_line(bytes.substr(0, length), result);
        bytes.remove_prefix(length);
    }
    return result;
}

void SlcanAdapter::push_line(std::string_view bytes, Result& result) {
    const std::uint64_t before = parser_.dropped();
    for (const SlcanLine& line : parser_.push(bytes)) {
        if (line.kind == SlcanLine::Kind::kText) {
            result.answer += answer_to(line.text);
        } else if (line.kind == SlcanLine::Kind::kFrame && open_) {
            result.frames.push_back(line.frame);
            result.answer += line.frame.extended ? "Z\r" : "z\r";
        } else if (line.kind == SlcanLine::Kind::kFrame) {
            result.answer += kBell;
        }
    }
    result.answer += std::string(parser_.dropped() - before, kBell);
}

std::string SlcanAdapter::answer_to(const std::string& command) {
    const std::string yes(1, kReturn);
    const std::string no(1, kBell);
    switch (command[0]) {
        case 'S':
            return !open_ && command.size() == 2 && command[1] >= '0' && command[1] <= '8' ? yes
                                                                                           : no;
        case 'O':
        case 'C': {
            const bool opens = command[0] == 'O';
            const bool changes = command.size() == 1 && open_ != opens;
            open_ = changes ? opens : open_;
            return changes ? yes : no;
        }
        case 'V':
            return "V1013\r";
        case 'N':
            return "N4242\r";
        case 'F':
            return "F00\r";
        case 'Z':
            return command == "Z0" ? yes : no;  // this one has no clock
        default:
            return no;
    }
}

}  // namespace hybrid_slam
