// SPDX-License-Identifier: Apache-2.0
#include "carmen_line.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam::carmen {
namespace {

/// "ipc_timestamp ipc_hostname logger_timestamp" at the end of each line.
constexpr std::size_t kTrailer = 3;
/// "type start field_of_view resolution maximum accuracy remission_mode" of RAWLASER and
/// ROBOTLASER.
constexpr std::size_t kSensorFields = 7;
/// "laser_x laser_y laser_theta robot_x robot_y robot_theta tv rv forward_safety side_safety".
constexpr std::size_t kRobotFields = 10;

/// Seconds and metres beyond these are noise; differences of them must not overflow.
constexpr double kMaxStamp = 1e12;
constexpr double kMaxCoordinate = 1e7;

/// Digits with at most one point, as nearly all numbers in a log are: exact, for the digits and the
/// power of ten are exact doubles, so that the one division rounds as it must. False for all else.
bool parse_plain_decimal(std::string_view word, double& value) {
    constexpr std::array<double, 19> kPowers{1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,
                                             1e7,  1e8,  1e9,  1e10, 1e11, 1e12, 1e13,
                                             1e14, 1e15, 1e16, 1e17, 1e18};
    constexpr std::int64_t kExact = std::int64_t{1} << 53;
    std::int64_t digits = 0;
    const char* point = nullptr;
    const char* const end = word.data() + word.size();
    if (word.size() >= kPowers.size()) {
        return false;
    }
    for (const char* at = word.data(); at != end; ++at) {
        if (*at >= '0' && *at <= '9') {
            digits = 10 * digits + (*at - '0');
        } else if (*at == '.' && point == nullptr) {
            point = at;
        } else {
            return false;
        }
    }
    const bool has_digits = word.size() > (point == nullptr ? 0U : 1U);
    const std::size_t decimals = point == nullptr ? 0 : static_cast<std::size_t>(end - point - 1);
    value = static_cast<double>(digits) / kPowers[decimals];
    return has_digits && digits < kExact;
}

bool parse_number(std::string_view word, double& value) {
    return parse_plain_decimal(word, value) || parse_double(word, value);
}

bool parse_stamp(std::string_view word, double& stamp) {
    return parse_number(word, stamp) && std::abs(stamp) < kMaxStamp;
}

bool parse_count(std::string_view word, std::size_t& count) {
    long number = 0;
    if (!parse_long(word, number) || number < 0) {
        return false;
    }
    count = static_cast<std::size_t>(number);
    return true;
}

float to_range(double value) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    if (std::abs(value) > static_cast<double>(std::numeric_limits<float>::max())) {
        return value > 0.0 ? kInfinity : -kInfinity;
    }
    return static_cast<float>(value);
}

bool parse_ranges(const Words& words, std::size_t first, std::size_t count,
                  std::vector<float>& ranges) {
    ranges.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        double value = 0.0;
        if (!parse_number(words[first + i], value)) {
            return false;
        }
        ranges[i] = to_range(value);
    }
    return true;
}

/// Takes three words as a pose; false when they are no numbers. `usable` turns false for inf, NaN
/// and coordinates out of all proportion.
bool parse_pose(const Words& words, std::size_t first, Pose2d& pose, bool& usable) {
    std::array<double, 3> numbers{};
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        if (!parse_number(words[first + i], numbers[i])) {
            return false;
        }
        usable = usable && std::abs(numbers[i]) < kMaxCoordinate;
    }
    if (usable) {
        pose = Pose2d(numbers[0], numbers[1], normalize_angle(numbers[2]));
    }
    return true;
}

bool parse_pose_pair(const Words& words, std::size_t first, LaserLine& laser) {
    laser.has_poses = true;
    return parse_pose(words, first, laser.odom_from_laser, laser.has_poses) &&
           parse_pose(words, first + 3, laser.odom_from_robot, laser.has_poses);
}

/// FLASER n r1..rn x y theta odom_x odom_y odom_theta stamp [host [logger_stamp]]
bool parse_old_laser(const Words& words, bool complete, LaserLine& laser) {
    std::size_t beams = 0;
    if (words.size() < 2 || !parse_count(words[1], beams) || beams == 0 || beams > words.size()) {
        return false;
    }
    const std::size_t poses = 2 + beams;
    const std::size_t stamp = poses + 6;
    const std::size_t least = stamp + (complete ? 1 : 2);
    if (words.size() < least || words.size() > stamp + kTrailer) {
        return false;
    }
    return parse_ranges(words, 2, beams, laser.ranges) && parse_pose_pair(words, poses, laser) &&
           parse_stamp(words[stamp], laser.stamp);
}

bool parse_sensor_fields(const Words& words, LaserLine& laser) {
    std::array<double, kSensorFields> fields{};
    for (std::size_t i = 0; i < kSensorFields; ++i) {
        if (!parse_number(words[1 + i], fields[i])) {
            return false;
        }
    }
    const double start = fields[1];
    const double increment = fields[3];
    if (std::abs(start) <= 2.0 * kPi && increment > 0.0 && increment <= 2.0 * kPi) {
        laser.fan = Fan{start, increment};
    }
    const double maximum = fields[4];
    if (maximum > 0.0 && std::isfinite(maximum)) {
        laser.range_max = maximum;
    }
    return true;
}

/// Where the poses of a ROBOTLASER stand, by the words that are left after the ranges. The older
/// vintage has neither remissions nor, at the end, a turn axis: told apart from the end of the
/// line.
std::optional<std::size_t> find_robot_poses(const Words& words, std::size_t after_ranges) {
    const std::size_t left = words.size() - after_ranges;
    constexpr std::size_t kOld = kRobotFields + kTrailer;
    std::size_t remissions = 0;
    if (left > kOld && parse_count(words[after_ranges], remissions) && remissions < left) {
        const std::size_t behind = left - 1 - remissions;
        if (behind == kOld || behind == kOld + 1) {
            return after_ranges + 1 + remissions;
        }
    }
    return left == kOld ? std::optional(after_ranges) : std::nullopt;
}

/// RAWLASER ends after the remissions, which the older vintage does not have either.
bool is_raw_trailer(const Words& words, std::size_t after_ranges) {
    const std::size_t left = words.size() - after_ranges;
    std::size_t remissions = 0;
    return left == kTrailer || (left > kTrailer && parse_count(words[after_ranges], remissions) &&
                                left == 1 + remissions + kTrailer);
}

/// In a line without its end, whether the three words of the trailer are there: the host is no
/// number.
bool has_trailer(const Words& words) {
    double number = 0.0;
    return !parse_number(words[words.size() - 2], number);
}

bool parse_new_laser(LaserKind kind, const Words& words, LaserLine& laser) {
    constexpr std::size_t kCount = 1 + kSensorFields;
    std::size_t beams = 0;
    if (words.size() < kCount + 1 + kTrailer || !parse_count(words[kCount], beams) || beams == 0 ||
        beams > words.size() - (kCount + 1 + kTrailer)) {
        return false;
    }
    if (!parse_sensor_fields(words, laser) ||
        !parse_ranges(words, kCount + 1, beams, laser.ranges) ||
        !parse_stamp(words[words.size() - kTrailer], laser.stamp)) {
        return false;
    }
    const std::size_t after_ranges = kCount + 1 + beams;
    if (kind == LaserKind::kRaw) {
        return is_raw_trailer(words, after_ranges);
    }
    const std::optional<std::size_t> poses = find_robot_poses(words, after_ranges);
    return poses && parse_pose_pair(words, *poses, laser);
}

/// The word is `stem` and one or more digits.
bool is_numbered(std::string_view word, std::string_view stem) {
    return word.size() > stem.size() && word.size() <= stem.size() + 2 &&
           word.substr(0, stem.size()) == stem &&
           word.find_first_not_of("0123456789", stem.size()) == std::string_view::npos;
}

}  // namespace

Fan infer_fan(std::size_t beams, std::optional<double> resolution_deg) {
    const auto count = static_cast<double>(beams);
    const bool half_circle = beams == 180 || beams == 360 || beams == 361;
    if (!half_circle && resolution_deg) {
        const double increment = radians(*resolution_deg);
        const double span = (count - 1.0) * increment;
        if (increment > 0.0 && span <= 2.0 * kPi) {
            return {-span / 2.0, increment};
        }
    }
    const bool both_ends = beams % 2 == 1 && beams > 1;
    return {-kPi / 2.0, kPi / (both_ends ? count - 1.0 : count)};
}

LaserKind laser_kind(std::string_view word) {
    if (word == "FLASER") {
        return LaserKind::kFront;
    }
    if (word == "RLASER") {
        return LaserKind::kRear;
    }
    if (is_numbered(word, "LASER")) {
        return LaserKind::kOther;
    }
    if (is_numbered(word, "ROBOTLASER")) {
        return LaserKind::kRobot;
    }
    return is_numbered(word, "RAWLASER") ? LaserKind::kRaw : LaserKind::kNone;
}

int laser_rank(std::string_view word) {
    constexpr int kNever = 9;
    switch (laser_kind(word)) {
        case LaserKind::kFront:
            return 0;
        case LaserKind::kRobot:
            return word == "ROBOTLASER1" ? 0 : (word == "ROBOTLASER0" ? 1 : 3);
        case LaserKind::kRear:
            return 2;
        case LaserKind::kOther:
            return 3;
        case LaserKind::kRaw:
            return word == "RAWLASER1" ? 4 : 5;
        case LaserKind::kNone:
            break;
    }
    return kNever;
}

void split(std::string_view line, Words& words) {
    words.clear();
    const char* at = line.data();
    const char* const end = at + line.size();
    const auto is_blank = [](char letter) { return letter == ' ' || letter == '\t'; };
    while (at != end) {
        while (at != end && is_blank(*at)) {
            ++at;
        }
        const char* const begin = at;
        while (at != end && !is_blank(*at)) {
            ++at;
        }
        if (at != begin) {
            words.emplace_back(begin, static_cast<std::size_t>(at - begin));
        }
    }
}

bool parse_laser(LaserKind kind, const Words& words, bool complete, LaserLine& laser) {
    laser.fan.reset();
    laser.range_max.reset();
    laser.has_poses = false;
    switch (kind) {
        case LaserKind::kFront:
        case LaserKind::kRear:
        case LaserKind::kOther:
            return parse_old_laser(words, complete, laser);
        case LaserKind::kRobot:
        case LaserKind::kRaw:
            return parse_new_laser(kind, words, laser) && (complete || has_trailer(words));
        case LaserKind::kNone:
            break;
    }
    return false;
}

bool parse_odom(const Words& words, bool complete, OdomLine& odom) {
    constexpr std::size_t kStamp = 7;  // ODOM x y theta tv rv accel stamp [host [logger_stamp]]
    if (words.size() < kStamp + (complete ? 1 : 2) || words.size() > kStamp + kTrailer) {
        return false;
    }
    bool usable = true;
    return parse_pose(words, 1, odom.odom_from_robot, usable) && usable &&
           parse_stamp(words[kStamp], odom.stamp);
}

}  // namespace hybrid_slam::carmen
