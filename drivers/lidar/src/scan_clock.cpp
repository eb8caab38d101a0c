// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/lidar/scan_clock.hpp"

#include <algorithm>
#include <limits>

#include "envelope.hpp"

namespace hybrid_slam {

struct ScanClock::State {
    ScanClockConfig config;
    ArrivalEnvelope envelope;
    ArrivalLine line;  ///< what the nominal period leaves
    bool running = false;
    std::uint32_t newest_count = 0;
    double first_arrival = 0.0;
    double count = 0.0;  ///< of the newest, from the first one of the fit on
    double stamp = 0.0;
    double late_since = 0.0;  ///< arrival from which on all have been too late; infinite: none
    std::uint64_t resets = 0;

    double fitted(double at) const {
        return first_arrival + (config.count_period * at + line.at(at));
    }
    double period() const { return config.count_period + line.slope; }
    bool is_off(double at, double arrival);
    void begin(std::uint32_t first, double arrival);
};

bool ScanClock::State::is_off(double at, double arrival) {
    constexpr double kPatience = 2.0;  // seconds; what a stalled host held back comes at once
    const double late = arrival - fitted(at);
    if (late <= config.reset_after) {
        late_since = std::numeric_limits<double>::infinity();
        return late < -config.reset_after;
    }
    late_since = std::min(late_since, arrival);
    return arrival - late_since > kPatience;
}

void ScanClock::State::begin(std::uint32_t first, double arrival) {
    envelope.clear();
    envelope.add({}, 0.0);
    line = {};
    running = true;
    newest_count = first;
    first_arrival = arrival;
    count = 0.0;
    stamp = arrival;
    late_since = std::numeric_limits<double>::infinity();
}

ScanClock::ScanClock(const ScanClockConfig& config) : state_(std::make_unique<State>()) {
    state_->config = config;
}
ScanClock::~ScanClock() = default;
ScanClock::ScanClock(ScanClock&&) noexcept = default;
ScanClock& ScanClock::operator=(ScanClock&&) noexcept = default;

double ScanClock::stamp(std::uint32_t count, double arrival) {
    State& s = *state_;
    // Modulo 2^32, so that the counter may wrap.
    const auto steps = static_cast<std::int32_t>(count - s.newest_count);
    if (s.running && steps == 0) {
        return s.stamp;
    }
    if (!s.running || steps < 0 || s.is_off(s.count + steps, arrival)) {
        s.resets += s.running ? 1U : 0U;
        s.begin(count, arrival);
        return s.stamp;
    }
    s.newest_count = count;
    s.count += steps;
    s.envelope.add({s.count, (arrival - s.first_arrival) - s.config.count_period * s.count},
                   s.config.window / s.config.count_period);
    s.line = s.envelope.fit(s.config.period_tolerance * s.config.count_period);
    s.stamp = std::max(s.fitted(s.count), s.stamp + 0.5 * s.period() * steps);
    return s.stamp;
}

double ScanClock::count_period() const {
    return state_->period();
}

std::uint64_t ScanClock::resets() const {
    return state_->resets;
}

}  // namespace hybrid_slam
