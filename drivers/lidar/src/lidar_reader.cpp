// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/lidar/lidar_reader.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/lidar/scan_clock.hpp"
#include "s300_layout.hpp"
#include "thesis_words.hpp"

namespace hybrid_slam {
namespace {

constexpr double kMetresPerCount = 0.01;

LidarConfig checked(LidarConfig config) {
    ConfigSchema schema;
    const ConfigSchema::Section section(schema, "lidar");
    describe(schema, config);  // throws for values out of their ranges
    if (config.blind_sectors_deg.size() % 2 != 0) {
        throw Error("lidar.blind_sectors_deg: must hold pairs of from and to");
    }
    if (config.range_min >= config.range_max) {
        throw Error("lidar.range_min: must be less than lidar.range_max");
    }
    return config;
}

/// Which piece of the stream came when.
class ArrivalTimes {
  public:
    void add(std::uint64_t end, double arrival) {
        if (!pieces_.empty() && pieces_.back().arrival == arrival) {
            pieces_.back().end = end;
        } else {
            pieces_.push_back({end, arrival});
        }
    }

    /// Once all telegrams found have been asked for: one that is found later did not end longer ago
    /// than what is kept.
    void forget_old() {
        while (!pieces_.empty() && pieces_.front().end + kKeptBytes < pieces_.back().end) {
            pieces_.pop_front();
        }
    }

    /// Of the piece that the byte before `end` came in.
    double of_byte_before(std::uint64_t end) const {
        const auto piece =
            std::lower_bound(pieces_.begin(), pieces_.end(), end,
                             [](const Piece& a, std::uint64_t offset) { return a.end < offset; });
        return piece->arrival;
    }

  private:
    struct Piece {
        std::uint64_t end;
        double arrival;
    };
    static constexpr std::uint64_t kKeptBytes =
        2 * (S300Decoder::kWitnessBytes + S300Decoder::kMostBytes);
    std::deque<Piece> pieces_;
};

/// How far the scan counter goes from scan to scan: mostly. An S300 counts turns of its mirror and
/// sends every second one; at a low baud rate fewer.
class UsualStep {
  public:
    /// How many scans are missing before one that came `steps` after the last.
    std::uint64_t missed(std::uint32_t steps) {
        const std::size_t place = std::min<std::size_t>(steps, seen_.size() - 1);
        ++seen_[place];
        if (seen_[place] > seen_[usual_] || (seen_[place] == seen_[usual_] && place < usual_)) {
            usual_ = place;
        }
        return steps / usual_ - 1 + (steps < usual_ ? 1 : 0);
    }

  private:
    std::array<std::uint64_t, 64> seen_{};
    std::size_t usual_ = 63;
};

ScanClockConfig clock_config(const LidarConfig& config) {
    ScanClockConfig clock;
    clock.count_period = config.count_period;
    return clock;
}

}  // namespace

struct LidarReader::State {
    explicit State(const LidarConfig& reader_config)
        : config(checked(reader_config)), clock(clock_config(config)) {}

    LidarConfig config;
    S300Decoder s300;
    ThesisWordsDecoder thesis;
    ArrivalTimes arrivals;
    ScanClock clock;
    LidarCounts counts;
    S300Telegram telegram;

    bool started = false;  ///< a telegram with distances has come
    std::uint8_t address = 0;
    std::uint8_t field = 0;
    std::uint32_t scan_number = 0;
    double arrival = 0.0;  ///< of that scan
    double fitted = 0.0;   ///< that arrival without its jitter
    UsualStep usual_step;
    std::vector<bool> blind;  ///< of each beam

    bool thesis_words() const { return config.protocol == LidarProtocol::kThesisWords; }
    bool fetch();
    bool is_followed() const;
    bool is_wanted();
    bool count_step();
    bool fit_clock(double now);
    bool counter_jumped(std::int32_t steps, double now) const;
    double stamp() const;
    double angle_min() const;
    double angle_increment() const;
    void find_blind_beams();
    Scan make_scan();
    void count_scan(const Scan& scan);
};

bool LidarReader::State::fetch() {
    const bool found = thesis_words() ? thesis.next(telegram) : s300.next(telegram);
    counts.stream = thesis_words() ? thesis.counts() : s300.counts();
    if (!found) {
        arrivals.forget_old();
    }
    return found;
}

bool LidarReader::State::is_followed() const {
    if (config.address != 0 && !thesis_words()) {
        return telegram.address == config.address;
    }
    return !started || telegram.address == address;
}

/// Whether the telegram is of the device and field that are being followed.
bool LidarReader::State::is_wanted() {
    if (!is_followed()) {
        ++counts.other_devices;
        return false;
    }
    counts.other_fields += telegram.more_fields;
    if (telegram.words.empty()) {
        counts.lockout_telegrams += telegram.status != 0 ? 1U : 0U;
        ++counts.without_distances;
        return false;
    }
    if (started && telegram.field != field) {
        ++counts.other_fields;
        return false;
    }
    return true;
}

/// True when the scan does not fit to the ones before, so that the clock started anew. The thesis's
/// stream counts nothing that a clock could be fitted to.
bool LidarReader::State::fit_clock(double now) {
    if (thesis_words()) {
        fitted = now;
        return false;
    }
    fitted = clock.stamp(telegram.scan_number, now);
    return std::exchange(counts.clock_resets, clock.resets()) != clock.resets();
}

/// Why a new fit: a scanner that was switched off and on counts from anew, lower or far ahead. Else
/// it was the host's clock, which may be set back while scans go on (or some seconds of them are
/// lost).
bool LidarReader::State::counter_jumped(std::int32_t steps, double now) const {
    constexpr double kSlack = 10.0;  // seconds
    return steps < 0 || steps * config.count_period > std::max(now - arrival, 0.0) + kSlack;
}

/// Follows the scan counter; false for a scan that has been given already.
bool LidarReader::State::count_step() {
    const auto steps = static_cast<std::int32_t>(telegram.scan_number - scan_number);
    const double now = arrivals.of_byte_before(telegram.end);
    if (started && steps == 0) {
        ++counts.repeated_scans;
        return false;
    }
    const bool new_fit = fit_clock(now);
    if (started && new_fit && counter_jumped(steps, now)) {
        ++counts.counter_resets;
    } else if (started) {
        counts.missed_scans += usual_step.missed(static_cast<std::uint32_t>(steps));
    }
    started = true;
    address = telegram.address;
    field = telegram.field;
    scan_number = telegram.scan_number;
    arrival = now;
    return true;
}

/// Of the first beam of the scan just counted.
double LidarReader::State::stamp() const {
    return fitted - config.wire_time(telegram.end - telegram.begin) - config.latency;
}

/// Beams go counter-clockwise as the scanner sees it, symmetric to the middle of the fan; hung
/// upside down, clockwise.
double LidarReader::State::angle_increment() const {
    return config.upside_down ? -config.angle_step : config.angle_step;
}

double LidarReader::State::angle_min() const {
    const auto gaps = static_cast<double>(telegram.words.size() - 1);
    return config.angle_offset - 0.5 * gaps * angle_increment();
}

void LidarReader::State::find_blind_beams() {
    const auto turned = [](double from, double to) {  // degrees, counter-clockwise
        return to - from >= 360.0 ? 360.0 : std::fmod(std::fmod(to - from, 360.0) + 360.0, 360.0);
    };
    const std::vector<double>& sectors = config.blind_sectors_deg;
    blind.assign(telegram.words.size(), false);
    for (std::size_t beam = 0; beam < blind.size(); ++beam) {
        constexpr double kRounding = 1e-6;  // so that a beam on the limit is in, at both ends
        const double angle = degrees(angle_min() + static_cast<double>(beam) * angle_increment());
        for (std::size_t i = 0; i + 1 < sectors.size(); i += 2) {
            const double width = turned(sectors[i], sectors[i + 1]) + 2.0 * kRounding;
            blind[beam] = blind[beam] || turned(sectors[i] - kRounding, angle) <= width;
        }
    }
}

Scan LidarReader::State::make_scan() {
    const std::size_t beams = telegram.words.size();
    if (blind.size() != beams) {
        find_blind_beams();
    }
    Scan scan;
    scan.stamp = stamp();
    scan.angle_min = angle_min();
    scan.angle_increment = angle_increment();
    scan.range_min = config.range_min;
    scan.range_max = config.range_max;
    scan.time_increment = config.time_increment();
    scan.robot_from_laser = config.robot_from_laser();
    scan.ranges.resize(beams);
    scan.flags.resize(beams);
    for (std::size_t i = 0; i < beams; ++i) {
        const unsigned word = telegram.words[i];
        const unsigned distance = word & kS300DistanceMask;
        const double range = kMetresPerCount * distance;
        const bool nothing =
            distance == 0 || distance == kS300NoReturn || range >= config.range_max;
        scan.ranges[i] =
            nothing ? std::numeric_limits<float>::infinity() : static_cast<float>(range);
        if (blind[i] || distance == 0) {
            scan.ranges[i] = std::numeric_limits<float>::quiet_NaN();
        }
        scan.flags[i] = beam_flags(word, telegram.protocol);
    }
    return scan;
}

void LidarReader::State::count_scan(const Scan& scan) {
    ++counts.scans;
    counts.beams += scan.ranges.size();
    counts.no_returns += static_cast<std::uint64_t>(
        std::count_if(scan.ranges.begin(), scan.ranges.end(),
                      [&](float range) { return !scan.is_return(range); }));
    counts.protective_scans += scan.has(kProtectiveField) ? 1U : 0U;
    counts.warning_scans += scan.has(kWarningField) ? 1U : 0U;
}

LidarReader::LidarReader(const LidarConfig& config) : state_(std::make_unique<State>(config)) {}
LidarReader::~LidarReader() = default;
LidarReader::LidarReader(LidarReader&&) noexcept = default;
LidarReader& LidarReader::operator=(LidarReader&&) noexcept = default;

void LidarReader::push(const LidarBytes& bytes) {
    State& state = *state_;
    if (bytes.bytes.empty()) {
        return;
    }
    if (state.thesis_words()) {
        state.thesis.push(bytes.bytes.data(), bytes.bytes.size());
        state.counts.stream = state.thesis.counts();
    } else {
        state.s300.push(bytes.bytes.data(), bytes.bytes.size());
        state.counts.stream = state.s300.counts();
    }
    state.arrivals.add(state.counts.stream.bytes, bytes.arrival);
}

std::optional<Scan> LidarReader::next() {
    State& state = *state_;
    while (state.fetch()) {
        if (!state.is_wanted() || !state.count_step()) {
            continue;
        }
        const std::vector<std::uint16_t>& words = state.telegram.words;
        if (state.telegram.status != 0) {
            ++state.counts.lockout_telegrams;
        } else if (std::all_of(words.begin(), words.end(),
                               [](std::uint16_t word) { return word == kS300Standby; })) {
            ++state.counts.standby_scans;
        } else {
            Scan scan = state.make_scan();
            state.count_scan(scan);
            return scan;
        }
    }
    return std::nullopt;
}

const LidarCounts& LidarReader::counts() const {
    return state_->counts;
}

double LidarReader::count_period() const {
    return state_->clock.count_period();
}

}  // namespace hybrid_slam
