// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/ip/tcp.hpp>
#include <chrono>

namespace hybrid_slam {

/// Small lines go at once; a peer that lost its power or its cable is noticed within `patience`
/// seconds, whether or not something is on the way to it.
void set_up(asio::ip::tcp::socket& socket, double patience);

/// Bytes that the peer has not confirmed; 0 when the system does not tell.
std::size_t unconfirmed_bytes(asio::ip::tcp::socket& socket);

inline std::chrono::nanoseconds nanoseconds(double seconds) {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(
        std::chrono::duration<double>(seconds));
}

}  // namespace hybrid_slam
