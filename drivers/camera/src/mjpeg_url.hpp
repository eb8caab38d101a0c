// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace hybrid_slam {

inline constexpr std::string_view kHttpScheme = "http://";
inline constexpr std::string_view kHttpsScheme = "https://";

/// Where a network camera's stream is.
struct MjpegUrl {
    std::string host;
    std::uint16_t port = 80;
    std::string path = "/";     ///< with the query
    std::string authorization;  ///< base64 of user:password; empty: none
    std::string name;           ///< for messages: the URL without the password

    std::string request() const;
};

/// http://[user:password@]host[:port][/path]. Throws Error, with nothing of the password in it.
MjpegUrl parse_mjpeg_url(const std::string& text);

}  // namespace hybrid_slam
