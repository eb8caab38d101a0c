// SPDX-License-Identifier: Apache-2.0
#include "sensor_motions.hpp"

#include <algorithm>
#include <cmath>

namespace hybrid_slam {
namespace {

/// The speed of the camera is taken over so many seconds to both sides: between two images alone
/// the noise would look like changes of speed, and these are what tells the time offset.
constexpr double kReach = 0.15;
constexpr double kSameStamp = 1e-6;  // seconds

/// The index after the last scan of the unbroken run that starts at `first`.
std::size_t end_of_run(const Trajectory& lidar, std::size_t first, double max_gap) {
    std::size_t end = first + 1;
    while (end < lidar.size() && lidar[end].stamp > lidar[end - 1].stamp &&
           lidar[end].stamp - lidar[end - 1].stamp <= max_gap) {
        ++end;
    }
    return end;
}

LaserStep step_between(const Trajectory& lidar, std::size_t begin, std::size_t end,
                       const Pose2d& robot_from_laser) {
    LaserStep step;
    step.begin = lidar[begin].stamp;
    step.end = lidar[end].stamp;
    for (std::size_t i = begin; i < end; ++i) {
        const Pose2d moved = robot_from_laser.inverse() *
                             between(lidar[i].pose, lidar[i + 1].pose) * robot_from_laser;
        step.begin_from_end = step.begin_from_end * moved;
        step.integral += moved.log();
    }
    return step;
}

}  // namespace

CameraTrack::CameraTrack(const std::vector<VisualMotion>& vision, const Pose2d& robot_from_camera,
                         double max_gap) {
    for (const VisualMotion& motion : vision) {
        // Without the floor the way is a guess, and a turn is easily taken for a step aside.
        if (motion.status == VisualStatus::kGood) {
            append(motion, robot_from_camera.inverse() * motion.before_from_now * robot_from_camera,
                   max_gap);
        }
    }
}

void CameraTrack::append(const VisualMotion& motion, const Pose2d& camera_before_from_now,
                         double max_gap) {
    const double elapsed = motion.stamp - motion.from_stamp;
    const bool backward = !nodes_.empty() && motion.from_stamp < nodes_.back().stamp - kSameStamp;
    if (!(elapsed > 0.0 && elapsed <= max_gap) || backward) {
        return;
    }
    if (nodes_.empty() || motion.from_stamp > nodes_.back().stamp + kSameStamp) {
        nodes_.push_back({motion.from_stamp, {}, nodes_.empty() ? 0 : nodes_.back().piece + 1});
    }
    const Node& last = nodes_.back();
    nodes_.push_back({motion.stamp, last.pose * camera_before_from_now, last.piece});
}

std::optional<CameraTrack::Node> CameraTrack::at(double stamp) const {
    const auto after = std::lower_bound(nodes_.begin(), nodes_.end(), stamp,
                                        [](const Node& a, double b) { return a.stamp < b; });
    if (after == nodes_.end() || after == nodes_.begin()) {
        return std::nullopt;
    }
    const Node& before = *std::prev(after);
    if (before.piece != after->piece) {
        return std::nullopt;
    }
    const double ratio = (stamp - before.stamp) / (after->stamp - before.stamp);
    return Node{stamp, interpolate(before.pose, after->pose, ratio), after->piece};
}

std::optional<CameraTrack::State> CameraTrack::state(double stamp) const {
    const auto now = at(stamp);
    if (!now) {
        return std::nullopt;
    }
    Node before = *now;
    Node after = *now;
    if (const auto node = at(stamp - kReach); node && node->piece == now->piece) {
        before = *node;
    }
    if (const auto node = at(stamp + kReach); node && node->piece == now->piece) {
        after = *node;
    }
    const double elapsed = after.stamp - before.stamp;
    if (!(elapsed > 0.0)) {
        return std::nullopt;
    }
    return State{*now, between(before.pose, after.pose).log() / elapsed};
}

std::optional<CameraTrack::Motion> CameraTrack::motion(double begin, double end) const {
    const auto from = state(begin);
    const auto to = state(end);
    if (!from || !to || from->node.piece != to->node.piece) {
        return std::nullopt;
    }
    return Motion{between(from->node.pose, to->node.pose), from->twist, to->twist};
}

std::vector<LaserStep> laser_steps(const ExtrinsicsDrive& drive, double length, double max_gap) {
    const Trajectory& lidar = drive.lidar;
    std::vector<LaserStep> steps;
    std::size_t first = 0;
    while (first < lidar.size()) {
        const std::size_t run_end = end_of_run(lidar, first, max_gap);
        std::size_t end = first;
        double next = lidar[first].stamp;
        for (std::size_t begin = first; begin < run_end; ++begin) {
            if (lidar[begin].stamp < next - kSameStamp) {
                continue;
            }
            while (end < run_end && lidar[end].stamp < lidar[begin].stamp + length - kSameStamp) {
                ++end;
            }
            if (end == run_end) {
                break;
            }
            steps.push_back(step_between(lidar, begin, end, drive.robot_from_laser));
            next = lidar[begin].stamp + length;
        }
        first = run_end;
    }
    return steps;
}

bool moves(const LaserStep& step) {
    constexpr double kLeastWay = 0.02;           // metres
    constexpr double kLeastTurn = radians(1.0);  // radians
    return step.begin_from_end.translation.norm() > kLeastWay ||
           std::abs(step.integral.z()) > kLeastTurn;
}

}  // namespace hybrid_slam
