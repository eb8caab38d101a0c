// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/trajectory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam {
namespace {

/// The heading of a rotation that may be off the plane a little, and need not be normalised.
double yaw_of(double qx, double qy, double qz, double qw) {
    return normalize_angle(
        std::atan2(2.0 * (qw * qz + qx * qy), qw * qw + qx * qx - qy * qy - qz * qz));
}

StampedPose parse_tum_line(const TextFileReader& reader, const std::string& line) {
    constexpr const char* kWanted = "must be eight numbers: stamp tx ty tz qx qy qz qw";
    std::array<double, 8> values{};
    Tokens tokens(line);
    for (double& value : values) {
        if (!parse_double(tokens.next(), value) || !std::isfinite(value)) {
            throw Error(reader.where() + ": " + kWanted);
        }
    }
    if (!tokens.next().empty()) {
        throw Error(reader.where() + ": " + kWanted);
    }
    const auto [stamp, tx, ty, tz, qx, qy, qz, qw] = values;
    if (!(qx * qx + qy * qy + qz * qz + qw * qw > 1e-12)) {
        throw Error(reader.where() + ": the quaternion is zero");
    }
    return {stamp, Pose2d(tx, ty, yaw_of(qx, qy, qz, qw))};
}

bool earlier(const StampedPose& a, const StampedPose& b) {
    return a.stamp < b.stamp;
}

}  // namespace

Trajectory read_tum(const std::filesystem::path& file) {
    TextFileReader reader(file);
    Trajectory trajectory;
    std::string line;
    while (reader.next(line)) {
        const std::string_view first = Tokens(line).next();
        if (!first.empty() && first[0] != '#') {
            trajectory.push_back(parse_tum_line(reader, line));
        }
    }
    if (reader.corrupt()) {
        throw Error(reader.where() + ": the file is truncated or corrupt after this line");
    }
    if (trajectory.empty()) {
        throw Error(file.string() + ": holds no pose");
    }
    return trajectory;
}

void write_tum(const std::filesystem::path& file, const Trajectory& trajectory) {
    TextFileWriter writer(file);
    for (const auto& [stamp, pose] : trajectory) {
        writer.write(fmt::format("{:.6f} {:.9f} {:.9f} 0 0 0 {:.12f} {:.12f}\n", stamp, pose.x(),
                                 pose.y(), std::sin(0.5 * pose.heading),
                                 std::cos(0.5 * pose.heading)));
    }
    writer.close();
}

double length_of(const Trajectory& trajectory) {
    constexpr double kStep = 0.05;  // metres; shorter ones are noise as much as way
    if (trajectory.empty()) {
        return 0.0;
    }
    double length = 0.0;
    Eigen::Vector2d counted = trajectory.front().pose.translation;
    for (const StampedPose& pose : trajectory) {
        const double step = (pose.pose.translation - counted).norm();
        if (step >= kStep) {
            length += step;
            counted = pose.pose.translation;
        }
    }
    return length + (trajectory.back().pose.translation - counted).norm();
}

TrajectoryIndex::TrajectoryIndex(const Trajectory& trajectory) {
    // A stamp that is not a number has no place in an order.
    std::copy_if(trajectory.begin(), trajectory.end(), std::back_inserter(sorted_),
                 [](const StampedPose& pose) { return !std::isnan(pose.stamp); });
    std::stable_sort(sorted_.begin(), sorted_.end(), earlier);
}

std::optional<Pose2d> TrajectoryIndex::nearest(double stamp, double tolerance) const {
    const auto after =
        std::lower_bound(sorted_.begin(), sorted_.end(), StampedPose{stamp, {}}, earlier);
    std::optional<Pose2d> found;
    double least = tolerance;
    if (after != sorted_.end() && after->stamp - stamp <= least) {
        least = after->stamp - stamp;
        found = after->pose;
    }
    if (after != sorted_.begin()) {
        const StampedPose& before = *std::prev(after);
        if (stamp - before.stamp < least || (!found && stamp - before.stamp <= least)) {
            found = before.pose;
        }
    }
    return found;
}

std::optional<Pose2d> TrajectoryIndex::interpolated(double stamp, double max_gap) const {
    const auto after =
        std::lower_bound(sorted_.begin(), sorted_.end(), StampedPose{stamp, {}}, earlier);
    if (after == sorted_.end()) {
        return std::nullopt;
    }
    if (after->stamp == stamp) {
        return after->pose;
    }
    if (after == sorted_.begin()) {
        return std::nullopt;
    }
    const StampedPose& before = *std::prev(after);
    const double gap = after->stamp - before.stamp;
    constexpr double kStampRounding = 1e-6;  // a gap of just max_gap must not fail by rounding
    if (gap > max_gap + kStampRounding) {
        return std::nullopt;
    }
    return interpolate(before.pose, after->pose, (stamp - before.stamp) / gap);
}

}  // namespace hybrid_slam
