// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/lockstep/lockstep_server.hpp"

#include <fmt/format.h>

#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <chrono>
#include <optional>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "io/tcp_server.hpp"
#include "line_socket.hpp"

namespace hybrid_slam {
namespace {

using asio::ip::tcp;
using Clock = std::chrono::steady_clock;

constexpr double kHelloPatience = 2.0;  // seconds

Clock::time_point after(double seconds) {
    return Clock::now() +
           std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

double seconds_until(Clock::time_point time) {
    return std::chrono::duration<double>(time - Clock::now()).count();
}

}  // namespace

struct LockstepServer::Impl {
    Impl(const std::string& listen, double patience_in)
        : patience(patience_in), acceptor(listen_on(context, parse_endpoint(listen))) {}

    std::optional<tcp::socket> accept(double timeout);
    void welcome(tcp::socket socket);
    void tell_sensors(const std::string& line);
    LineSocket::Read answer(std::string& line, const std::function<void()>& meanwhile);
    void lose_sensors() {
        sensors.reset();
        counts.sensors_gone = true;
    }

    double patience;
    asio::io_context context{1};
    tcp::acceptor acceptor;
    std::optional<LineSocket> sensors;
    std::optional<LineSocket> drive;
    std::uint64_t unread = 0;  ///< announced, and not read by the sensors' end so far
    LockstepCounts counts;
};

std::optional<tcp::socket> LockstepServer::Impl::accept(double timeout) {
    std::optional<tcp::socket> accepted;
    acceptor.async_accept([&accepted](std::error_code error, tcp::socket socket) {
        if (!error) {
            accepted.emplace(std::move(socket));
        }
    });
    context.restart();
    context.run_for(std::chrono::duration_cast<std::chrono::nanoseconds>(
        std::chrono::duration<double>(timeout)));
    if (!context.stopped()) {
        acceptor.cancel();
        context.run();  // the handler refers to variables here: it must have run
    }
    return accepted;
}

void LockstepServer::Impl::welcome(tcp::socket socket) {
    LineSocket client(context, std::move(socket));
    std::string line;
    if (client.read(line, kHelloPatience) != LineSocket::Read::kLine) {
        return;
    }
    if (line == "hello sensors 1" && !sensors) {
        sensors.emplace(std::move(client));
    } else if (line == "hello drive 1" && !drive) {
        drive.emplace(std::move(client));
    } else {
        client.write("refused");
    }
}

void LockstepServer::Impl::tell_sensors(const std::string& line) {
    if (!sensors) {
        return;
    }
    if (sensors->write(line)) {
        ++unread;
    } else {
        lose_sensors();
    }
}

LineSocket::Read LockstepServer::Impl::answer(std::string& line,
                                              const std::function<void()>& meanwhile) {
    if (!meanwhile) {
        return drive->read(line, patience);
    }
    constexpr double kSlice = 0.002;  // seconds
    const Clock::time_point deadline = after(patience);
    auto read = LineSocket::Read::kTimeout;
    while (read == LineSocket::Read::kTimeout && Clock::now() < deadline) {
        read = drive->read(line, kSlice);
        meanwhile();
    }
    return read;
}

LockstepServer::LockstepServer(const std::string& listen, double patience)
    : impl_(std::make_unique<Impl>(listen, patience)) {}

LockstepServer::~LockstepServer() {
    for (std::optional<LineSocket>* client : {&impl_->sensors, &impl_->drive}) {
        if (*client) {
            (*client)->write("end");
        }
    }
}

std::string LockstepServer::url() const {
    return fmt::format("tcp://127.0.0.1:{}", impl_->acceptor.local_endpoint().port());
}

bool LockstepServer::wait_for_clients(double timeout) {
    const Clock::time_point deadline = after(timeout);
    while (!impl_->sensors || !impl_->drive) {
        const double left = seconds_until(deadline);
        if (left <= 0.0) {
            return false;
        }
        if (auto socket = impl_->accept(left)) {
            impl_->welcome(std::move(*socket));
        }
    }
    return true;
}

void LockstepServer::wait_until_read() {
    std::string line;
    while (impl_->sensors && impl_->unread > 0) {
        switch (impl_->sensors->read(line, impl_->patience)) {
            case LineSocket::Read::kLine:
                --impl_->unread;
                break;
            case LineSocket::Read::kClosed:
                impl_->lose_sensors();
                break;
            case LineSocket::Read::kTimeout:
                throw Error(
                    fmt::format("lockstep: the sensors' end has not read its lines for "
                                "{:g} s",
                                impl_->patience));
        }
    }
}

void LockstepServer::lidar(double arrival, std::size_t bytes) {
    impl_->tell_sensors(fmt::format("lidar {} {}", arrival, bytes));
    ++impl_->counts.lidar;
}

void LockstepServer::image(double arrival) {
    impl_->tell_sensors(fmt::format("image {}", arrival));
    ++impl_->counts.images;
}

std::size_t LockstepServer::tick(const LockstepTick& tick, const std::function<void()>& meanwhile) {
    if (!impl_->drive) {
        throw LockstepClosed("lockstep: no drive is connected");
    }
    const bool wait_for_pose = tick.pose_due && impl_->sensors.has_value();
    std::string line;
    auto answer = LineSocket::Read::kClosed;
    if (impl_->drive->write(
            fmt::format("tick {} {} {}", tick.now, wait_for_pose ? 1 : 0, tick.frames))) {
        answer = impl_->answer(line, meanwhile);
    }
    if (answer == LineSocket::Read::kTimeout) {
        throw Error(fmt::format("lockstep: no answer of the drive for {:g} s, at {:.2f} s{}",
                                impl_->patience, tick.now,
                                wait_for_pose ? " (it waits for a pose)" : ""));
    }
    if (answer == LineSocket::Read::kClosed) {
        impl_->drive.reset();
        throw LockstepClosed(fmt::format("lockstep: the drive left at {:.2f} s", tick.now));
    }
    const std::vector<std::string> words = words_of(line);
    if (words.size() != 2 || words[0] != "done") {
        throw Error("lockstep: the drive says '" + line + "' in place of done");
    }
    ++impl_->counts.ticks;
    return count_of(words[1]);
}

LockstepCounts LockstepServer::counts() const {
    return impl_->counts;
}

}  // namespace hybrid_slam
