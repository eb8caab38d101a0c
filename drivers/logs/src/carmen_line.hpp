// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "hybrid_slam/core/pose2.hpp"

/// The lines of a CARMEN log, each by itself. Layouts: CARMEN's logger, "message_name [message
/// contents] ipc_timestamp ipc_hostname logger_timestamp".
namespace hybrid_slam::carmen {

struct Fan {
    double angle_min = 0.0;        ///< radians
    double angle_increment = 0.0;  ///< radians
};

/// The fan of a line without angles; the rule is in carmen_log.hpp.
Fan infer_fan(std::size_t beams, std::optional<double> resolution_deg);

enum class LaserKind { kNone, kFront, kRear, kOther, kRobot, kRaw };

/// The layout that a line's first word stands for; kNone when it is no laser.
LaserKind laser_kind(std::string_view word);

/// Which of several lasers is delivered: the lowest. Those of one rank are alternatives.
int laser_rank(std::string_view word);

struct LaserLine {
    double stamp = 0.0;
    std::vector<float> ranges;
    std::optional<Fan> fan;           ///< when the line says it
    std::optional<double> range_max;  ///< metres, when the line says it
    bool has_poses = false;           ///< the layout has them and they are finite
    Pose2d odom_from_laser;
    Pose2d odom_from_robot;
};

struct OdomLine {
    double stamp = 0.0;
    Pose2d odom_from_robot;
};

using Words = std::vector<std::string_view>;

/// Splits at blanks and tabs into `words`, which is cleared first.
void split(std::string_view line, Words& words);

/// False when the line does not have the layout of its kind. `complete` is false for a last line
/// without its end: one whose stamp may be torn is refused.
bool parse_laser(LaserKind kind, const Words& words, bool complete, LaserLine& laser);
bool parse_odom(const Words& words, bool complete, OdomLine& odom);

}  // namespace hybrid_slam::carmen
