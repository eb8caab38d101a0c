// SPDX-License-Identifier: Apache-2.0
#include "socket_options.hpp"

#include <linux/sockios.h>
#include <netinet/tcp.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cmath>

namespace hybrid_slam {
namespace {

template <int Name>
using TcpOption = asio::detail::socket_option::integer<IPPROTO_TCP, Name>;

}  // namespace

void set_up(asio::ip::tcp::socket& socket, double patience) {
    const int seconds = std::max(2, static_cast<int>(std::lround(patience)));
    std::error_code ignored;  // without them it works, only less promptly
    socket.set_option(asio::ip::tcp::no_delay(true), ignored);
    socket.set_option(asio::socket_base::keep_alive(true), ignored);
    socket.set_option(TcpOption<TCP_KEEPIDLE>(1), ignored);
    socket.set_option(TcpOption<TCP_KEEPINTVL>(1), ignored);
    socket.set_option(TcpOption<TCP_KEEPCNT>(seconds - 1), ignored);
    socket.set_option(TcpOption<TCP_USER_TIMEOUT>(1000 * seconds), ignored);
}

std::size_t unconfirmed_bytes(asio::ip::tcp::socket& socket) {
    int bytes = 0;
    return ioctl(socket.native_handle(), SIOCOUTQ, &bytes) == 0 && bytes > 0
               ? static_cast<std::size_t>(bytes)
               : 0;
}

}  // namespace hybrid_slam
