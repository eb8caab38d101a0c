// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/can/candump.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "hex.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam {
namespace {

constexpr std::int64_t kSecond = 1000000;  // microseconds
constexpr std::uint32_t kErrorFlag = 0x20000000U;

bool all_digits(std::string_view text) {
    return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

/// (seconds.microseconds)
std::int64_t parse_stamp(std::string_view token) {
    const bool brackets = token.size() > 2 && token.front() == '(' && token.back() == ')';
    const std::string_view inner = brackets ? token.substr(1, token.size() - 2) : "";
    const std::size_t dot = inner.find('.');
    if (dot != std::string_view::npos) {
        const std::string_view seconds = inner.substr(0, dot);
        const std::string_view fraction = inner.substr(dot + 1);
        // Longer than 12 digits would overflow, and is no time that anybody lives to see.
        if (all_digits(seconds) && seconds.size() <= 12 && all_digits(fraction) &&
            fraction.size() == 6) {
            return std::stoll(std::string(seconds)) * kSecond + std::stoll(std::string(fraction));
        }
    }
    throw Error(fmt::format("'{}': not a time like (1700000000.000000)", token));
}

/// What is written must be what is read again.
void check_bus(const std::string& bus) {
    const auto visible = [](unsigned char c) { return c > ' ' && c != 0x7F; };
    if (bus.empty() || !std::all_of(bus.begin(), bus.end(), visible)) {
        throw Error(fmt::format("'{}': not a name of a bus", bus));
    }
}

CanFrame parse_id(std::string_view text) {
    const auto id = parse_hex(text);
    CanFrame frame;
    frame.id = id.value_or(0);
    frame.extended = text.size() == 8;
    if (id && frame.extended && (*id & kErrorFlag) != 0) {
        throw Error(fmt::format("'{}': an error frame", text));
    }
    if (!id || (text.size() != 3 && text.size() != 8) || !frame.valid()) {
        throw Error(fmt::format("'{}': not an id of 3 or 8 hex digits", text));
    }
    return frame;
}

/// What follows the #.
void parse_contents(std::string_view text, CanFrame& frame) {
    if (!text.empty() && text.front() == '#') {
        throw Error("CAN FD is not supported");
    }
    frame.remote = !text.empty() && text.front() == 'R';
    if (!frame.remote) {
        if (!parse_data(text, frame)) {
            throw Error(fmt::format("'{}': not up to 8 bytes of two hex digits", text));
        }
        return;
    }
    const std::string_view size = text.substr(1);
    if (!size.empty() && (size.size() > 1 || size[0] < '0' || size[0] > '8')) {
        throw Error(fmt::format("'{}': not R or R0 to R8", text));
    }
    frame.size = static_cast<std::uint8_t>(size.empty() ? 0 : size[0] - '0');
}

}  // namespace

std::string to_candump(const CandumpLine& line) {
    const CanFrame& frame = line.frame;
    if (!frame.valid()) {
        throw Error(fmt::format("CAN frame {:X}: id or size does not fit", frame.id));
    }
    check_bus(line.bus);
    if (line.microseconds < 0) {
        throw Error("a time before 1970");
    }
    std::string contents = data_to_hex(frame);
    if (frame.remote) {
        contents = frame.size == 0 ? "R" : fmt::format("R{}", frame.size);
    }
    return fmt::format("({:010}.{:06}) {} {}#{}", line.microseconds / kSecond,
                       line.microseconds % kSecond, line.bus,
                       to_hex(frame.id, frame.extended ? 8 : 3), contents);
}

CandumpLine parse_candump(std::string_view line) {
    Tokens tokens(line);
    CandumpLine result;
    result.microseconds = parse_stamp(tokens.next());
    result.bus = tokens.next();
    check_bus(result.bus);
    const std::string_view frame = tokens.next();
    const std::size_t hash = frame.find('#');
    if (hash == std::string_view::npos) {
        throw Error(fmt::format("'{}': not a frame like 203#0100", frame));
    }
    result.frame = parse_id(frame.substr(0, hash));
    parse_contents(frame.substr(hash + 1), result.frame);
    const std::string_view direction = tokens.next();
    if ((!direction.empty() && direction != "R" && direction != "T") || !tokens.next().empty()) {
        throw Error("more behind the frame than a direction");
    }
    return result;
}

std::vector<CandumpLine> read_candump(const std::filesystem::path& file) {
    TextFileReader reader(file);
    std::vector<CandumpLine> lines;
    std::string line;
    while (reader.next(line)) {
        if (line.find_first_not_of(" \t") == std::string::npos) {
            continue;
        }
        try {
            lines.push_back(parse_candump(line));
        } catch (const Error& error) {
            throw Error(reader.where() + ": " + error.what());
        }
    }
    if (reader.corrupt()) {
        throw Error(file.string() + ": the compressed file is damaged");
    }
    return lines;
}

}  // namespace hybrid_slam
