// SPDX-License-Identifier: Apache-2.0
#include "drive.hpp"

#include <algorithm>
#include <cmath>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr double kCornerRadius = 0.5;         ///< metres, where there is room
constexpr double kSharpest = radians(135.0);  ///< turned on the spot from here on
constexpr double kShareOfLeg = 0.45;          ///< that one corner may take of a leg
constexpr double kSamePoint = 1e-6;           ///< metres

double heading_of(const Eigen::Vector2d& direction) {
    return std::atan2(direction.y(), direction.x());
}

/// The way points of all laps, without those that repeat the one before.
Points way_points(const World& world) {
    Points points;
    for (int lap = 0; lap < world.laps; ++lap) {
        for (const Point2& point : world.path) {
            if (points.empty() || (point - points.back()).norm() > kSamePoint) {
                points.push_back(point);
            }
        }
    }
    return points;
}

struct Corner {
    double angle = 0.0;   ///< radians, to the left
    double radius = 0.0;  ///< metres; 0 = turned on the spot
    double cut = 0.0;     ///< metres that the arc takes from both legs
};

/// An arc that touches both legs takes radius * tan(angle / 2) from each.
Corner round_corner(const Eigen::Vector2d& leg, const Eigen::Vector2d& next_leg) {
    Corner corner;
    corner.angle = normalize_angle(heading_of(next_leg) - heading_of(leg));
    const double tangent = std::tan(std::abs(corner.angle) / 2.0);
    if (tangent > 1e-9 && std::abs(corner.angle) < kSharpest) {
        const double room = kShareOfLeg * std::min(leg.norm(), next_leg.norm());
        corner.cut = std::min(kCornerRadius * tangent, room);
        corner.radius = corner.cut / tangent;
    }
    return corner;
}

}  // namespace

Drive::Drive(const World& world, double speed, double turn_rate)
    : speed_(speed), turn_rate_(turn_rate) {
    const Points points = way_points(world);
    if (points.size() < 2) {
        throw Error("world " + world.name + ": path needs two different points");
    }
    const double first_heading = heading_of(points[1] - points[0]);
    world_from_robot_ = Pose2d(points[0], world.start_heading.value_or(first_heading));
    add_turn(normalize_angle(first_heading - world_from_robot_.heading), 0.0);

    double cut_at_start = 0.0;
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
        const Eigen::Vector2d leg = points[i + 1] - points[i];
        const bool is_last = i + 2 == points.size();
        const Corner corner = is_last ? Corner() : round_corner(leg, points[i + 2] - points[i + 1]);
        add_straight(leg.norm() - cut_at_start - corner.cut);
        add_turn(corner.angle, corner.radius);
        cut_at_start = corner.cut;
    }
}

void Drive::add_straight(double length) {
    add_piece(speed_, 0.0, length / speed_);
}

void Drive::add_turn(double angle, double radius) {
    if (std::abs(angle) < 1e-9) {
        return;
    }
    const double rate = radius > 0.0 ? std::min(turn_rate_, speed_ / radius) : turn_rate_;
    add_piece(rate * radius, std::copysign(rate, angle), std::abs(angle) / rate);
}

void Drive::add_piece(double speed, double turn_rate, double seconds) {
    pieces_.push_back({world_from_robot_, speed, turn_rate, duration(), seconds});
    world_from_robot_ =
        world_from_robot_ * Pose2d::exp(seconds * Eigen::Vector3d(speed, 0.0, turn_rate));
}

double Drive::duration() const {
    return pieces_.empty() ? 0.0 : pieces_.back().start + pieces_.back().duration;
}

Pose2d Drive::world_from_robot(double time) const {
    const auto after =
        std::upper_bound(pieces_.begin(), pieces_.end(), time,
                         [](double value, const DrivePiece& piece) { return value < piece.start; });
    const DrivePiece& piece = after == pieces_.begin() ? *after : *(after - 1);
    const double elapsed = std::clamp(time - piece.start, 0.0, piece.duration);
    return piece.world_from_start *
           Pose2d::exp(elapsed * Eigen::Vector3d(piece.speed, 0.0, piece.turn_rate));
}

}  // namespace hybrid_slam
