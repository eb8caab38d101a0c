// SPDX-License-Identifier: Apache-2.0
#include "line_socket.hpp"

#include <array>
#include <asio/buffer.hpp>
#include <asio/connect.hpp>
#include <asio/write.hpp>
#include <charconv>
#include <chrono>
#include <cmath>
#include <sstream>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/io/endpoint.hpp"

namespace hybrid_slam {
namespace {

using asio::ip::tcp;

constexpr std::size_t kLongestLine = 256;

[[noreturn]] void refuse(const std::string& word) {
    throw Error("lockstep: '" + word + "' in place of a number");
}

template <typename Number>
Number parse(const std::string& word) {
    Number number{};
    const char* const end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, number);
    if (error != std::errc() || stop != end) {
        refuse(word);
    }
    return number;
}

}  // namespace

LineSocket::LineSocket(asio::io_context& context, tcp::socket socket)
    : context_(context), socket_(std::move(socket)) {
    std::error_code ignored;
    // A tick is a line there and a line back: none may wait for company.
    socket_.set_option(tcp::no_delay(true), ignored);
}

bool LineSocket::take_line(std::string& line) {
    const std::size_t end = buffer_.find('\n');
    if (end == std::string::npos) {
        return false;
    }
    line = buffer_.substr(0, end);
    buffer_.erase(0, end + 1);
    return true;
}

LineSocket::Read LineSocket::read(std::string& line, double timeout) {
    using Clock = std::chrono::steady_clock;
    const auto deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                             std::chrono::duration<double>(timeout));
    while (!take_line(line)) {
        if (closed_ || buffer_.size() > kLongestLine) {
            closed_ = true;
            return Read::kClosed;
        }
        std::array<char, 1024> bytes{};
        std::error_code error;
        std::size_t count = 0;
        socket_.async_read_some(asio::buffer(bytes),
                                [&](const std::error_code& how, std::size_t much) {
                                    error = how;
                                    count = much;
                                });
        context_.restart();
        context_.run_until(deadline);
        if (!context_.stopped()) {
            socket_.cancel();
            context_.run();  // the handler refers to variables here: it must have run
        }
        buffer_.append(bytes.data(), count);
        if (error == asio::error::operation_aborted) {
            return take_line(line) ? Read::kLine : Read::kTimeout;
        }
        closed_ = static_cast<bool>(error);
    }
    return Read::kLine;
}

bool LineSocket::write(const std::string& line) {
    if (!closed_) {
        std::error_code error;
        asio::write(socket_, asio::buffer(line + "\n"), error);
        closed_ = static_cast<bool>(error);
    }
    return !closed_;
}

tcp::socket connect_to(asio::io_context& context, const std::string& url) {
    const Endpoint endpoint = parse_endpoint(url);
    tcp::socket socket(context);
    std::error_code error;
    tcp::resolver resolver(context);
    const auto found = resolver.resolve(endpoint.host, std::to_string(endpoint.port), error);
    if (!error) {
        asio::connect(socket, found, error);
    }
    if (error) {
        throw Error(url + ": no clock: " + error.message());
    }
    return socket;
}

std::vector<std::string> words_of(const std::string& line) {
    std::istringstream stream(line);
    std::vector<std::string> words;
    for (std::string word; stream >> word;) {
        words.push_back(word);
    }
    return words;
}

double number_of(const std::string& word) {
    const auto number = parse<double>(word);
    if (!std::isfinite(number)) {
        refuse(word);
    }
    return number;
}

std::size_t count_of(const std::string& word) {
    constexpr std::size_t kMost = 1000000;
    const auto count = parse<std::size_t>(word);
    if (count > kMost) {
        refuse(word);
    }
    return count;
}

}  // namespace hybrid_slam
