// SPDX-License-Identifier: Apache-2.0
#include "http_head.hpp"

#include <algorithm>

namespace hybrid_slam {
namespace {

char lower(char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c + ('a' - 'A')) : c;
}

}  // namespace

std::string lowered(std::string_view text) {
    std::string result(text);
    std::transform(result.begin(), result.end(), result.begin(), lower);
    return result;
}

std::string_view trimmed(std::string_view text) {
    const std::size_t begin = std::min(text.find_first_not_of(" \t\r"), text.size());
    const std::string_view rest = text.substr(begin);
    return rest.substr(0, rest.find_last_not_of(" \t\r") + 1);
}

std::optional<std::size_t> parse_count(std::string_view text, unsigned base, std::size_t most) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::size_t value = 0;
    for (const char c : text) {
        const std::size_t digit = kDigits.substr(0, base).find(lower(c));
        if (digit == std::string_view::npos) {
            return std::nullopt;
        }
        value = value * base + digit;
        if (value > most) {
            return std::nullopt;
        }
    }
    return text.empty() ? std::nullopt : std::make_optional(value);
}

std::size_t end_of_head(std::string_view text) {
    const std::size_t crlf = text.find("\n\r\n");
    const std::size_t lf = text.find("\n\n");
    const std::size_t first = std::min(crlf, lf);
    return first == std::string_view::npos ? 0 : first + (first == crlf ? 3 : 2);
}

HttpHead::HttpHead(std::string_view text) : first(trimmed(text.substr(0, text.find('\n')))) {
    while (!text.empty()) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        const std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        const std::size_t colon = line.find(':');
        if (colon != std::string_view::npos) {
            fields[lowered(trimmed(line.substr(0, colon)))] = trimmed(line.substr(colon + 1));
        }
    }
}

const std::string& HttpHead::operator[](const std::string& name) const {
    static const std::string kNone;
    const auto found = fields.find(name);
    return found == fields.end() ? kNone : found->second;
}

}  // namespace hybrid_slam
