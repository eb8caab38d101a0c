// SPDX-License-Identifier: Apache-2.0
#include "mjpeg_url.hpp"

#include <algorithm>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr std::string_view kForm = ": not of the form http://[user:password@]host[:port]/path";

std::string base64(std::string_view text) {
    constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string code;
    for (std::size_t at = 0; at < text.size(); at += 3) {
        std::uint32_t bits = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            const bool there = at + i < text.size();
            bits = bits << 8U | (there ? static_cast<std::uint8_t>(text[at + i]) : 0U);
        }
        const std::size_t digits = std::min<std::size_t>(text.size() - at, 3) + 1;
        for (std::size_t i = 0; i < 4; ++i) {
            code += i < digits ? kDigits[bits >> (18 - 6 * i) & 63U] : '=';
        }
    }
    return code;
}

int hex_digit(char c) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    const char lower = c >= 'A' && c <= 'F' ? static_cast<char>(c + ('a' - 'A')) : c;
    const std::size_t at = kDigits.find(lower);
    return at == std::string_view::npos ? -1 : static_cast<int>(at);
}

/// %40 for an @ in a password.
std::string unescaped(std::string_view text) {
    std::string plain;
    for (std::size_t at = 0; at < text.size(); ++at) {
        const bool escape = text[at] == '%' && at + 2 < text.size() &&
                            hex_digit(text[at + 1]) >= 0 && hex_digit(text[at + 2]) >= 0;
        if (escape) {
            plain += static_cast<char>(16 * hex_digit(text[at + 1]) + hex_digit(text[at + 2]));
            at += 2;
        } else {
            plain += text[at];
        }
    }
    return plain;
}

std::uint16_t parse_port(std::string_view text, const std::string& name) {
    const bool digits = text.find_first_not_of("0123456789") == std::string_view::npos;
    const int port = !text.empty() && text.size() <= 5 && digits ? std::stoi(std::string(text)) : 0;
    if (port < 1 || port > 65535) {
        throw Error(name + std::string(kForm));
    }
    return static_cast<std::uint16_t>(port);
}

/// host, host:port, [::1]:port
void parse_authority(std::string_view text, MjpegUrl& url) {
    std::size_t end = text.find(':');
    if (!text.empty() && text.front() == '[') {
        const std::size_t bracket = text.find(']');
        if (bracket == std::string_view::npos) {
            throw Error(url.name + std::string(kForm));
        }
        url.host = text.substr(1, bracket - 1);
        end = bracket + 1 < text.size() ? bracket + 1 : std::string_view::npos;
    } else {
        url.host = text.substr(0, end);
    }
    if (end != std::string_view::npos) {
        url.port = parse_port(text[end] == ':' ? text.substr(end + 1) : "", url.name);
    }
    if (url.host.empty()) {
        throw Error(url.name + std::string(kForm));
    }
}

}  // namespace

std::string MjpegUrl::request() const {
    const std::string literal = host.find(':') == std::string::npos ? host : "[" + host + "]";
    std::string text = "GET " + path + " HTTP/1.1\r\nHost: " + literal + ":" +
                       std::to_string(port) +
                       "\r\nUser-Agent: hybrid-slam\r\nAccept: multipart/x-mixed-replace\r\n";
    if (!authorization.empty()) {
        text += "Authorization: Basic " + authorization + "\r\n";
    }
    return text + "Connection: close\r\n\r\n";
}

MjpegUrl parse_mjpeg_url(const std::string& text) {
    std::string_view rest = text;
    rest.remove_prefix(std::min(rest.find("://") + 3, rest.size()));
    rest = rest.substr(0, rest.find('#'));
    const std::size_t slash = std::min(rest.find_first_of("/?"), rest.size());
    std::string_view authority = rest.substr(0, slash);
    const std::string_view path = rest.substr(slash);
    const std::size_t at = authority.rfind('@');
    std::string secret;
    if (at != std::string_view::npos) {
        secret = unescaped(authority.substr(0, at));
        authority.remove_prefix(at + 1);
    }
    // What would end the line of the request, or be taken for a part of it.
    const auto is_blank = [](char c) { return c <= ' ' || c == 0x7F; };
    if (std::any_of(authority.begin(), authority.end(), is_blank) ||
        std::any_of(path.begin(), path.end(), is_blank)) {
        throw Error("the camera's URL has blanks in it");
    }
    MjpegUrl url;
    url.name = text.substr(0, text.find("://") + 3) + std::string(authority) + std::string(path);
    if (text.compare(0, kHttpsScheme.size(), kHttpsScheme) == 0) {
        throw Error(url.name +
                    ": https is not spoken here; use http, or a tunnel where others listen");
    }
    if (!path.empty()) {
        url.path = (path.front() == '/' ? "" : "/") + std::string(path);
    }
    url.authorization = base64(secret);
    parse_authority(authority, url);
    return url;
}

}  // namespace hybrid_slam
