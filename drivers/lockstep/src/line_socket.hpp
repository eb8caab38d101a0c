// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <optional>
#include <string>
#include <vector>

namespace hybrid_slam {

/// Lines over a TCP connection, for one thread that waits.
class LineSocket {
  public:
    LineSocket(asio::io_context& context, asio::ip::tcp::socket socket);

    enum class Read { kLine, kTimeout, kClosed };
    /// The next line without its end, after `timeout` seconds at most.
    Read read(std::string& line, double timeout);

    /// False when the other end is gone.
    bool write(const std::string& line);
    bool closed() const { return closed_; }

  private:
    bool take_line(std::string& line);

    asio::io_context& context_;
    asio::ip::tcp::socket socket_;
    std::string buffer_;  ///< what came and was not taken yet
    bool closed_ = false;
};

/// Throws Error with the address when nobody listens there.
asio::ip::tcp::socket connect_to(asio::io_context& context, const std::string& url);

/// Its words, of a line of words between single blanks.
std::vector<std::string> words_of(const std::string& line);
/// Throws Error when it is no finite number.
double number_of(const std::string& word);
/// Throws Error when it is no whole number up to a million.
std::size_t count_of(const std::string& word);

}  // namespace hybrid_slam
