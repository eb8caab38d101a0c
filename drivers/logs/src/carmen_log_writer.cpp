// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "carmen_line.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"
#include "hybrid_slam/logs/carmen_log.hpp"

namespace hybrid_slam {
namespace {

constexpr double kAngleTolerance = 1e-6;  ///< radians; far below the width of a beam

bool is_near(const carmen::Fan& fan, const Scan& scan) {
    const auto last = static_cast<double>(scan.ranges.size() - 1);
    const double at_start = fan.angle_min - scan.angle_min;
    const double at_end = at_start + last * (fan.angle_increment - scan.angle_increment);
    return std::abs(at_start) < kAngleTolerance && std::abs(at_end) < kAngleTolerance;
}

enum class Layout { kUndecided, kFlaser, kRobotLaser };

}  // namespace

struct CarmenLogWriter::State {
    explicit State(const std::filesystem::path& file_in) : file(file_in), out(file_in) {
        out.write(
            "# CARMEN Logfile\n"
            "# file format is one message per line\n"
            "# message_name [message contents] ipc_timestamp ipc_hostname logger_timestamp\n");
    }

    void take(const Scan& scan);
    void take(const WheelOdometry& odometry);
    void take(const Image& /*image*/) {}
    void take(const VisualMotion& /*motion*/) {}

    bool can_infer_fan(const Scan& scan);
    void write_parameter(std::string_view name, double value, double stamp);
    void write_held_odometry();
    void append_ranges(const Scan& scan);
    void append_poses(const Scan& scan);
    void append_trailer(double stamp);
    void flush();

    template <typename... Values>
    void append(fmt::format_string<Values...> format, const Values&... values) {
        fmt::format_to(std::back_inserter(text), format, values...);
    }

    std::filesystem::path file;
    TextFileWriter out;
    std::string text;
    Layout layout = Layout::kUndecided;
    std::optional<WheelOdometry> held;  ///< an ODOM line, unless the next scan has its stamp
    Pose2d newest_odom_from_robot;
    std::optional<double> resolution_deg;
    std::optional<double> range_max;
};

/// Whether a reader infers the fan of this scan from a FLASER line, if needed after one more PARAM.
bool CarmenLogWriter::State::can_infer_fan(const Scan& scan) {
    const std::size_t beams = scan.ranges.size();
    if (is_near(carmen::infer_fan(beams, resolution_deg), scan)) {
        return true;
    }
    const double resolution = degrees(scan.angle_increment);
    if (!is_near(carmen::infer_fan(beams, resolution), scan)) {
        return false;
    }
    resolution_deg = resolution;
    write_parameter("laser_front_laser_resolution", resolution, scan.stamp);
    return true;
}

void CarmenLogWriter::State::take(const Scan& scan) {
    if (scan.ranges.empty()) {
        throw Error(file.string() + ": a scan without beams cannot be written");
    }
    if (held && held->stamp == scan.stamp) {
        held.reset();
    }
    write_held_odometry();
    const bool inferable = layout != Layout::kRobotLaser && can_infer_fan(scan);
    if (layout == Layout::kFlaser && !inferable) {
        throw Error(file.string() + ": the fan changed to one that FLASER lines cannot tell");
    }
    layout = inferable ? Layout::kFlaser : Layout::kRobotLaser;
    if (inferable && range_max != scan.range_max && std::isfinite(scan.range_max)) {
        range_max = scan.range_max;
        write_parameter("robot_front_laser_max", scan.range_max, scan.stamp);
    }
    if (inferable) {
        append("FLASER {}", scan.ranges.size());
        append_ranges(scan);
        append_poses(scan);
    } else {
        const double span = static_cast<double>(scan.ranges.size() - 1) * scan.angle_increment;
        append("ROBOTLASER1 0 {} {} {} {} 0.01 0 {}", scan.angle_min, span, scan.angle_increment,
               scan.range_max, scan.ranges.size());
        append_ranges(scan);
        append(" 0");
        append_poses(scan);
        append(" 0 0 0 0 0");  // speeds, safety distances, turn axis: not known
    }
    append_trailer(scan.stamp);
}

void CarmenLogWriter::State::take(const WheelOdometry& odometry) {
    write_held_odometry();
    held = odometry;
    newest_odom_from_robot = odometry.odom_from_robot;
}

void CarmenLogWriter::State::write_parameter(std::string_view name, double value, double stamp) {
    append("PARAM {} {}", name, value);
    append_trailer(stamp);
}

void CarmenLogWriter::State::write_held_odometry() {
    if (!held) {
        return;
    }
    const Pose2d& pose = held->odom_from_robot;
    append("ODOM {:.9f} {:.9f} {:.9f} 0 0 0", pose.x(), pose.y(), pose.heading);
    append_trailer(held->stamp);
    held.reset();
}

void CarmenLogWriter::State::append_ranges(const Scan& scan) {
    for (const float range : scan.ranges) {
        if (scan.is_return(range)) {
            append(" {}", range);
        } else {
            append(" {}", std::isfinite(scan.range_max) ? scan.range_max : 1e6);
        }
    }
}

void CarmenLogWriter::State::append_poses(const Scan& scan) {
    const Pose2d& robot = newest_odom_from_robot;
    const Pose2d laser = robot * scan.robot_from_laser;
    append(" {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}", laser.x(), laser.y(), laser.heading,
           robot.x(), robot.y(), robot.heading);
}

void CarmenLogWriter::State::append_trailer(double stamp) {
    append(" {:.6f} nohost {:.6f}\n", stamp, stamp);
    flush();
}

void CarmenLogWriter::State::flush() {
    out.write(text);
    text.clear();
}

CarmenLogWriter::CarmenLogWriter(const std::filesystem::path& file)
    : state_(std::make_unique<State>(file)) {}

CarmenLogWriter::~CarmenLogWriter() = default;

void CarmenLogWriter::push(const Measurement& measurement) {
    std::visit([this](const auto& value) { state_->take(value); }, measurement);
}

void CarmenLogWriter::close() {
    state_->write_held_odometry();
    state_->out.close();
}

}  // namespace hybrid_slam
