// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/lockstep/lockstep_client.hpp"

#include <asio/io_context.hpp>

#include "hybrid_slam/core/error.hpp"
#include "line_socket.hpp"

namespace hybrid_slam {
namespace {

/// What both kinds of client do.
class ClockLine {
  public:
    ClockLine(const std::string& url, const std::string& role)
        : url_(url), socket_(context_, connect_to(context_, url)) {
        socket_.write("hello " + role + " 1");
    }

    /// The words of the next line; none at the end.
    std::vector<std::string> next(double timeout) {
        std::string line;
        if (ended_) {
            return {};
        }
        switch (socket_.read(line, timeout)) {
            case LineSocket::Read::kTimeout:
                return {};
            case LineSocket::Read::kClosed:
                ended_ = true;
                return {};
            case LineSocket::Read::kLine:
                break;
        }
        if (line == "refused") {
            throw Error(url_ + ": somebody else has this clock already");
        }
        ended_ = line == "end";
        return ended_ ? std::vector<std::string>() : words_of(line);
    }

    [[noreturn]] void misunderstood(const std::vector<std::string>& words) const {
        throw Error(url_ + ": is no lockstep clock, it says '" +
                    (words.empty() ? std::string() : words.front()) + "'");
    }

    void answer(const std::string& line) { socket_.write(line); }
    bool ended() const { return ended_; }

  private:
    std::string url_;
    asio::io_context context_{1};
    LineSocket socket_;
    bool ended_ = false;
};

}  // namespace

struct LockstepDriveClock::Impl : ClockLine {
    using ClockLine::ClockLine;
};

LockstepDriveClock::LockstepDriveClock(const std::string& url)
    : impl_(std::make_unique<Impl>(url, "drive")) {}
LockstepDriveClock::~LockstepDriveClock() = default;

std::optional<LockstepTick> LockstepDriveClock::next(double timeout) {
    const std::vector<std::string> words = impl_->next(timeout);
    if (words.empty()) {
        return std::nullopt;
    }
    if (words.size() != 4 || words[0] != "tick") {
        impl_->misunderstood(words);
    }
    return LockstepTick{number_of(words[1]), words[2] == "1", count_of(words[3])};
}

void LockstepDriveClock::done(std::size_t frames) {
    impl_->answer("done " + std::to_string(frames));
}

bool LockstepDriveClock::ended() const {
    return impl_->ended();
}

struct LockstepSensorClock::Impl : ClockLine {
    using ClockLine::ClockLine;
};

LockstepSensorClock::LockstepSensorClock(const std::string& url)
    : impl_(std::make_unique<Impl>(url, "sensors")) {}
LockstepSensorClock::~LockstepSensorClock() = default;

std::optional<LockstepArrival> LockstepSensorClock::next(double timeout) {
    const std::vector<std::string> words = impl_->next(timeout);
    if (words.empty()) {
        return std::nullopt;
    }
    LockstepArrival arrival;
    if (words.size() == 3 && words[0] == "lidar") {
        arrival.bytes = count_of(words[2]);
    } else if (words.size() == 2 && words[0] == "image") {
        arrival.what = LockstepArrival::What::kImage;
    } else {
        impl_->misunderstood(words);
    }
    arrival.arrival = number_of(words[1]);
    return arrival;
}

void LockstepSensorClock::done() {
    impl_->answer("done");
}

bool LockstepSensorClock::ended() const {
    return impl_->ended();
}

}  // namespace hybrid_slam
