// SPDX-License-Identifier: Apache-2.0
#include "fan_caster.hpp"

#include <algorithm>
#include <cmath>

namespace hybrid_slam {
namespace {

/// Rays through the corner of two walls must not slip between them by rounding.
constexpr double kOverlap = 1e-12;
/// Nearer than this to a half turn, a wall lies under the sensor and its angle has no side.
constexpr double kHalfTurnMargin = 1e-6;

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() * b.y() - a.y() * b.x();
}

/// What a wall or a post fills of the circle around the sensor, from `start` on counter-clockwise.
struct Sector {
    double start = 0.0;
    double width = 0.0;
};

Sector sector_of(const Segment& wall, const Point2& origin) {
    const Eigen::Vector2d to_start = wall.start - origin;
    const Eigen::Vector2d to_end = wall.end - origin;
    const double angle = std::atan2(cross(to_start, to_end), to_start.dot(to_end));
    if (std::abs(angle) > kPi - kHalfTurnMargin || to_start.isZero() || to_end.isZero()) {
        return {-kPi, 2.0 * kPi};
    }
    const Eigen::Vector2d& first = angle >= 0.0 ? to_start : to_end;
    return {std::atan2(first.y(), first.x()), std::abs(angle)};
}

Sector sector_of(const Circle& post, const Point2& origin) {
    const Eigen::Vector2d to_center = post.center - origin;
    const double distance = to_center.norm();
    if (distance <= post.radius) {
        return {-kPi, 2.0 * kPi};
    }
    const double half = std::asin(post.radius / distance);
    return {std::atan2(to_center.y(), to_center.x()) - half, 2.0 * half};
}

/// The part of the circle that a shape fills while the laser moves: what lies between its places at
/// the first and at the last beam, for both ends of a sector move one way in so short a time.
template <typename Shape>
Sector sector_of(const Shape& shape, const Point2& first_origin, const Point2& last_origin) {
    const Sector first = sector_of(shape, first_origin);
    if (first_origin == last_origin) {
        return first;
    }
    const Sector last = sector_of(shape, last_origin);
    const double shift = normalize_angle(last.start - first.start);
    const double start = std::min(0.0, shift);
    const double end = std::max(first.width, shift + last.width);
    return {first.start + start, std::min(end - start, 2.0 * kPi)};
}

/// All beams of one sweep with what each has met so far.
class Sweep {
  public:
    Sweep(const MovingLaser& laser, const BeamFan& fan)
        : first_angle_(laser.world_from_first.heading + fan.angle_min),
          angle_increment_(fan.angle_increment),
          ranges_(fan.beams, kNothingHit) {
        const double last = std::max(static_cast<double>(fan.beams) - 1.0, 1.0);
        const Pose2d motion = between(laser.world_from_first, laser.world_from_last);
        const Eigen::Vector3d step = motion.log() / last;
        angle_increment_ += step.z();
        origins_.reserve(fan.beams);
        directions_.reserve(fan.beams);
        const bool moves = !step.isZero(0.0);
        for (std::size_t i = 0; i < fan.beams; ++i) {
            const auto number = static_cast<double>(i);
            const double angle = first_angle_ + number * angle_increment_;
            directions_.emplace_back(std::cos(angle), std::sin(angle));
            origins_.push_back(
                moves ? (laser.world_from_first * Pose2d::exp(number * step)).translation
                      : laser.world_from_first.translation);
        }
    }

    template <typename Shape>
    void meet(const Shape& shape) {
        const Sector sector = sector_of(shape, origins_.front(), origins_.back());
        // The fan may be more than a full turn away from the sector's angle, and hold it twice.
        const double turn = 2.0 * kPi;
        const double span = static_cast<double>(ranges_.size()) * angle_increment_;
        double start = sector.start - first_angle_;
        start -= turn * std::ceil((start + sector.width + angle_increment_) / turn);
        while (start < span + angle_increment_) {
            meet_between(shape, start, start + sector.width);
            start += turn;
        }
    }

    std::vector<double> take_ranges() { return std::move(ranges_); }

  private:
    /// Tries the beams from one angle to another, counted from the first beam, and one more at each
    /// side.
    template <typename Shape>
    void meet_between(const Shape& shape, double from, double to) {
        const double last = static_cast<double>(ranges_.size()) - 1.0;
        const double lower = std::max(std::floor(from / angle_increment_) - 1.0, 0.0);
        const double upper = std::min(std::ceil(to / angle_increment_) + 1.0, last);
        if (lower > upper) {
            return;
        }
        const auto end = static_cast<std::size_t>(upper) + 1;
        for (auto i = static_cast<std::size_t>(lower); i < end; ++i) {
            ranges_[i] = std::min(ranges_[i], cast_ray(shape, origins_[i], directions_[i]));
        }
    }

    double first_angle_ = 0.0;
    double angle_increment_ =
        0.0;  ///< between two beams in the world, the laser's turning included
    std::vector<Point2> origins_;
    std::vector<Eigen::Vector2d> directions_;
    std::vector<double> ranges_;
};

}  // namespace

/// origin + t direction = start + u (end - start), both sides crossed with one and the other
/// direction.
double cast_ray(const Segment& wall, const Point2& origin, const Eigen::Vector2d& direction) {
    const Eigen::Vector2d along = wall.end - wall.start;
    const Eigen::Vector2d to_start = wall.start - origin;
    const double determinant = cross(direction, along);
    if (determinant == 0.0) {
        const double start = to_start.dot(direction);
        const double end = (wall.end - origin).dot(direction);
        const bool on_line = cross(to_start, direction) == 0.0 && std::max(start, end) >= 0.0;
        return on_line ? std::max(std::min(start, end), 0.0) : kNothingHit;
    }
    const double t = cross(to_start, along) / determinant;
    const double u = cross(to_start, direction) / determinant;
    const bool hit = t >= 0.0 && u >= -kOverlap && u <= 1.0 + kOverlap;
    return hit ? t : kNothingHit;
}

double cast_ray(const Circle& post, const Point2& origin, const Eigen::Vector2d& direction) {
    const Eigen::Vector2d to_center = post.center - origin;
    const double along = to_center.dot(direction);
    const double beside = cross(direction, to_center);
    const double half_chord_squared = post.radius * post.radius - beside * beside;
    if (half_chord_squared < 0.0) {
        return kNothingHit;
    }
    const double half_chord = std::sqrt(half_chord_squared);
    if (along - half_chord >= 0.0) {
        return along - half_chord;
    }
    return along + half_chord >= 0.0 ? along + half_chord : kNothingHit;
}

std::vector<double> cast_fan(const World& world, const MovingLaser& laser, const BeamFan& fan,
                             const std::vector<Circle>& people) {
    Sweep sweep(laser, fan);
    for (const Segment& wall : world.walls) {
        sweep.meet(wall);
    }
    for (const Circle& post : world.posts) {
        sweep.meet(post);
    }
    for (const Circle& person : people) {
        sweep.meet(person);
    }
    return sweep.take_ranges();
}

}  // namespace hybrid_slam
