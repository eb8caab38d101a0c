// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/io/endpoint.hpp"

#include <charconv>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr std::string_view kLoopback = "127.0.0.1";

[[noreturn]] void refuse(std::string_view text, const std::string& reason) {
    throw Error(std::string(text) + ": " + reason + "; wanted is host:port or tcp://host:port");
}

std::string_view without_scheme(std::string_view text) {
    const std::size_t mark = text.find("://");
    if (mark == std::string_view::npos) {
        return text;
    }
    if (text.substr(0, mark) != "tcp") {
        refuse(text, "only tcp:// is spoken");
    }
    return text.substr(mark + 3);
}

std::uint16_t parse_port(std::string_view text, std::string_view digits) {
    std::uint16_t port = 0;
    const char* const end = digits.data() + digits.size();
    const auto [stop, error] = std::from_chars(digits.data(), end, port);
    if (digits.empty() || error != std::errc() || stop != end) {
        refuse(text, "the port must be a number from 0 to 65535");
    }
    return port;
}

std::string parse_host(std::string_view text, std::string_view host) {
    const bool in_brackets = host.size() > 2 && host.front() == '[' && host.back() == ']';
    const std::string_view bare = in_brackets ? host.substr(1, host.size() - 2) : host;
    if (!in_brackets && bare.find(':') != std::string_view::npos) {
        refuse(text, "an IPv6 address stands in brackets, as in [::1]:5000");
    }
    if (bare.find_first_of("/[]@ \t\r\n") != std::string_view::npos) {
        refuse(text, "not a host");
    }
    return std::string(bare.empty() ? kLoopback : bare);
}

}  // namespace

Endpoint parse_endpoint(std::string_view text) {
    const std::string_view rest = without_scheme(text);
    const std::size_t colon = rest.rfind(':');
    if (colon == std::string_view::npos || rest.find(']', colon) != std::string_view::npos) {
        refuse(text, "no port");
    }
    return {parse_host(text, rest.substr(0, colon)), parse_port(text, rest.substr(colon + 1))};
}

std::string Endpoint::text() const {
    const bool is_ipv6 = host.find(':') != std::string::npos;
    return (is_ipv6 ? "[" + host + "]" : host) + ":" + std::to_string(port);
}

}  // namespace hybrid_slam
