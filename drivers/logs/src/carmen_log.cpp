// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/logs/carmen_log.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "carmen_line.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam {
namespace {

using carmen::LaserKind;
using carmen::LaserLine;
using carmen::Words;

constexpr std::size_t kForeignLines = 1000;  ///< without one of a log: this is none
constexpr std::size_t kProbeLines = 2000;  ///< after the first laser line, to meet the other lasers

constexpr double kMaxOffset = 2.0;  ///< metres between laser and robot
constexpr double kJitter = 0.002;   ///< metres
constexpr double kAngleJitter = radians(0.05);

constexpr std::size_t kMostIgnoredWords = 100;  ///< different ones that are told apart
constexpr std::size_t kLongestWord = 32;

bool is_carmen_word(std::string_view word) {
    return word == "PARAM" || word == "ODOM" || word == "SYNC" || word == "TRUEPOS" ||
           carmen::laser_kind(word) != LaserKind::kNone;
}

bool is_zero(const Pose2d& pose) {
    return pose.vector().isZero(0.0);
}

/// What the first lines of a log tell about the rest of it.
struct Probe {
    std::string laser;          ///< first word of the lines that are delivered
    bool has_odometry = false;  ///< the robot's pose in them is not always zero
};

/// Looks at one line after the other until it knows which laser to deliver.
class Prober {
  public:
    explicit Prober(const std::filesystem::path& file) : reader_(file) {}

    /// Throws Error when the file is no log.
    Probe run(const std::filesystem::path& file) {
        std::size_t lines_since_laser = 0;
        while (lines_since_laser < kProbeLines && reader_.next(line_)) {
            look_at_line();
            if (!is_log_ && reader_.line_number() >= kForeignLines) {
                break;
            }
            lines_since_laser += probe_.laser.empty() ? 0 : 1;
        }
        if (probe_.laser.empty()) {
            throw Error(file.string() + ": no CARMEN log (no readable laser line in the first " +
                        std::to_string(reader_.line_number()) + " lines)");
        }
        return probe_;
    }

  private:
    void look_at_line() {
        carmen::split(line_, words_);
        if (words_.empty()) {
            return;
        }
        is_log_ = is_log_ || is_carmen_word(words_[0]);
        const LaserKind kind = carmen::laser_kind(words_[0]);
        if (kind == LaserKind::kNone ||
            !parse_laser(kind, words_, !reader_.unterminated(), laser_)) {
            return;
        }
        const bool better = probe_.laser.empty() ||
                            carmen::laser_rank(words_[0]) < carmen::laser_rank(probe_.laser);
        if (better) {
            probe_ = {std::string(words_[0]), false};
        }
        if (words_[0] == probe_.laser && laser_.has_poses) {
            probe_.has_odometry = probe_.has_odometry || !is_zero(laser_.odom_from_robot);
        }
    }

    TextFileReader reader_;
    Probe probe_;
    bool is_log_ = false;
    std::string line_;
    Words words_;
    LaserLine laser_;
};

/// The first word of a line as it may be printed.
std::string printable(std::string_view word) {
    std::string text(word.substr(0, kLongestWord));
    std::replace_if(
        text.begin(), text.end(), [](char letter) { return letter < '!' || letter > '~'; }, '?');
    return text;
}

}  // namespace

struct CarmenLog::State {
    State(const std::filesystem::path& file, const CarmenLogConfig& config_in)
        : config(config_in), probe(Prober(file).run(file)), reader(file) {}

    /// Takes the next line; what it yields is put into the queue.
    bool take_line();
    void take_words();
    void take_odom();
    void take_laser(LaserKind kind);
    void take_parameter();

    void count_broken_line();
    void count_ignored(std::string_view word);
    void count_stamp(double stamp);
    void count_beams(const Scan& taken);

    void update_mounting();
    Scan make_scan() const;

    CarmenLogConfig config;
    Probe probe;
    TextFileReader reader;
    CarmenLogCounts counts;

    std::optional<double> resolution_deg;
    std::optional<double> parameter_range_max;
    std::optional<double> last_stamp;
    Pose2d robot_from_laser;

    std::string line;
    Words words;
    LaserLine laser;
    std::optional<WheelOdometry> odometry;  ///< to be delivered, before the scan
    std::optional<Scan> scan;
};

bool CarmenLog::State::take_line() {
    if (!reader.next(line)) {
        if (reader.corrupt()) {
            counts.torn_last_line = 1;
        }
        return false;
    }
    ++counts.lines;
    carmen::split(line, words);
    if (!words.empty()) {
        take_words();
    }
    return true;
}

void CarmenLog::State::take_words() {
    const std::string_view word = words[0];
    const LaserKind kind = carmen::laser_kind(word);
    if (kind != LaserKind::kNone && word == probe.laser) {
        take_laser(kind);
    } else if (word == "ODOM") {
        take_odom();
    } else if (word == "PARAM") {
        take_parameter();
    } else {
        count_ignored(word[0] == '#' ? "#" : word);
    }
}

void CarmenLog::State::take_odom() {
    carmen::OdomLine odom;
    if (!parse_odom(words, !reader.unterminated(), odom)) {
        count_broken_line();
        return;
    }
    ++counts.odometry;
    if (config.use_odom_lines) {
        odometry = WheelOdometry{odom.stamp, odom.odom_from_robot};
    }
}

void CarmenLog::State::take_laser(LaserKind kind) {
    if (!parse_laser(kind, words, !reader.unterminated(), laser)) {
        count_broken_line();
        return;
    }
    update_mounting();
    if (laser.has_poses && probe.has_odometry) {
        odometry = WheelOdometry{laser.stamp, laser.odom_from_robot};
    }
    scan = make_scan();
    count_stamp(laser.stamp);
    count_beams(*scan);
    ++counts.scans;
}

void CarmenLog::State::take_parameter() {
    if (words.size() < 3) {
        count_broken_line();
        return;
    }
    ++counts.parameters;
    double value = 0.0;
    if (!parse_double(words[2], value) || !(value > 0.0) || !std::isfinite(value)) {
        return;
    }
    const bool rear = carmen::laser_kind(probe.laser) == LaserKind::kRear;
    if (words[1] == (rear ? "laser_rear_laser_resolution" : "laser_front_laser_resolution")) {
        resolution_deg = value;
    } else if (words[1] == (rear ? "robot_rear_laser_max" : "robot_front_laser_max")) {
        parameter_range_max = value;
    }
}

void CarmenLog::State::count_broken_line() {
    if (reader.unterminated()) {
        counts.torn_last_line = 1;
    } else {
        ++counts.malformed_lines;
    }
}

void CarmenLog::State::count_ignored(std::string_view word) {
    const std::string name = printable(word);
    const bool room = counts.ignored.size() < kMostIgnoredWords || counts.ignored.count(name) != 0;
    ++counts.ignored[room ? name : "(others)"];
}

void CarmenLog::State::count_stamp(double stamp) {
    if (last_stamp) {
        counts.backward_stamps += stamp < *last_stamp ? 1 : 0;
        counts.duplicate_stamps += stamp == *last_stamp ? 1 : 0;
    }
    last_stamp = stamp;
}

void CarmenLog::State::count_beams(const Scan& taken) {
    counts.beams += taken.ranges.size();
    for (const float range : taken.ranges) {
        counts.no_returns += taken.is_return(range) ? 0 : 1;
        counts.not_finite += std::isfinite(range) ? 0 : 1;
    }
}

/// The two poses of a line are rounded, so that their difference jitters: the mounting stays as it
/// was until it really changes.
void CarmenLog::State::update_mounting() {
    if (!laser.has_poses) {
        counts.bad_poses += carmen::laser_kind(probe.laser) == LaserKind::kRaw ? 0 : 1;
        return;
    }
    probe.has_odometry = probe.has_odometry || !is_zero(laser.odom_from_robot);
    const Pose2d offset = between(laser.odom_from_robot, laser.odom_from_laser);
    if (offset.translation.norm() > kMaxOffset) {
        ++counts.bad_poses;
        robot_from_laser = Pose2d();
        return;
    }
    const Pose2d change = between(robot_from_laser, offset);
    if (change.translation.norm() > kJitter || std::abs(change.heading) > kAngleJitter) {
        robot_from_laser = offset;
    }
}

Scan CarmenLog::State::make_scan() const {
    Scan made;
    made.stamp = laser.stamp;
    made.ranges = laser.ranges;
    const carmen::Fan fan =
        laser.fan ? *laser.fan : carmen::infer_fan(laser.ranges.size(), resolution_deg);
    made.angle_min = fan.angle_min;
    made.angle_increment = fan.angle_increment;
    // As floats, for the ranges are: 5.6 in a line must not count as less than a maximum of 5.6.
    const std::optional<double> said = laser.range_max ? laser.range_max : parameter_range_max;
    made.range_min = static_cast<float>(config.range_min);
    made.range_max =
        static_cast<float>(std::min(config.range_max, said.value_or(config.range_max)));
    made.robot_from_laser = robot_from_laser;
    return made;
}

CarmenLog::CarmenLog(const std::filesystem::path& file, const CarmenLogConfig& config) {
    // A log is read twice, first to see which laser it holds: a pipe would wait for ever.
    if (std::filesystem::is_fifo(file)) {
        throw Error(file.string() + ": is a pipe; a log is read from a file");
    }
    state_ = std::make_unique<State>(file, config);
}

CarmenLog::~CarmenLog() = default;

std::optional<Measurement> CarmenLog::next() {
    State& state = *state_;
    while (!state.odometry && !state.scan) {
        if (!state.take_line()) {
            return std::nullopt;
        }
    }
    if (state.odometry) {
        return std::exchange(state.odometry, std::nullopt);
    }
    std::optional<Measurement> scan(std::move(*state.scan));
    state.scan.reset();
    return scan;
}

double CarmenLog::progress() const {
    return state_->reader.progress();
}

const CarmenLogCounts& CarmenLog::counts() const {
    return state_->counts;
}

}  // namespace hybrid_slam
