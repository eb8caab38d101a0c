// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/buffer.hpp>
#include <asio/error.hpp>
#include <asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <system_error>
#include <vector>

namespace hybrid_slam {

/// Runs what was started on `context` for at most `timeout` seconds; what is not done by then is
/// ended by `cancel`. True when it was done in time.
template <typename Cancel>
bool run_within(asio::io_context& context, double timeout, Cancel&& cancel) {
    context.restart();
    context.run_for(std::chrono::duration_cast<std::chrono::nanoseconds>(
        std::chrono::duration<double>(timeout)));
    if (context.stopped()) {
        return true;
    }
    cancel();
    context.run();  // the handler refers to the caller's variables: it must have run
    return false;
}

/// Replaces `bytes` by what `stream` has within `timeout` seconds; the error when the other end is
/// gone.
template <typename Stream>
std::error_code read_within(asio::io_context& context, Stream& stream,
                            std::vector<std::uint8_t>& bytes, double timeout) {
    constexpr std::size_t kMostBytes = 8192;
    bytes.resize(kMostBytes);
    std::error_code error;
    std::size_t count = 0;
    stream.async_read_some(asio::buffer(bytes), [&](const std::error_code& how, std::size_t much) {
        error = how;
        count = much;
    });
    run_within(context, timeout, [&stream] { stream.cancel(); });
    bytes.resize(count);
    return error == asio::error::operation_aborted ? std::error_code() : error;
}

}  // namespace hybrid_slam
