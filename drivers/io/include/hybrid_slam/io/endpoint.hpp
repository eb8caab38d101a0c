// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace hybrid_slam {

struct Endpoint {
    std::string host;  ///< without brackets
    std::uint16_t port = 0;

    std::string text() const;  ///< host:port, with brackets about an IPv6 address
};

/// tcp://host:port, host:port, [::1]:port; without a host (":5000") it is 127.0.0.1.
/// Throws Error that names `text`.
Endpoint parse_endpoint(std::string_view text);

}  // namespace hybrid_slam
