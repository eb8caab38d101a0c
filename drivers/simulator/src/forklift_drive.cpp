// SPDX-License-Identifier: Apache-2.0
#include "forklift_drive.hpp"

#include <algorithm>
#include <cmath>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr double kStep = 0.01;          ///< seconds between two states
constexpr double kPause = 0.5;          ///< seconds of standing still, before and after
constexpr double kLookAhead = 0.6;      ///< metres, at standstill
constexpr double kLookAheadTime = 0.5;  ///< seconds, on top
constexpr double kCrawl = 0.02;         ///< m/s, so that the end is reached
constexpr double kArrived = 0.02;       ///< metres before the end
constexpr double kPatience = 4.0;       ///< times the time that the path should take

/// A polyline by the distance along it.
class Polyline {
  public:
    explicit Polyline(const Points& points) {
        for (const Point2& point : points) {
            if (points_.empty()) {
                points_.push_back(point);
                lengths_.push_back(0.0);
                continue;
            }
            const double leg = (point - points_.back()).norm();
            if (leg > 1e-6) {
                lengths_.push_back(lengths_.back() + leg);
                points_.push_back(point);
            }
        }
        if (points_.size() < 2) {
            throw Error("the path needs two different points");
        }
    }

    double length() const { return lengths_.back(); }

    Point2 at(double distance) const {
        const std::size_t i = leg_at(distance);
        const double ratio = (distance - lengths_[i]) / (lengths_[i + 1] - lengths_[i]);
        return points_[i] + std::clamp(ratio, 0.0, 1.0) * (points_[i + 1] - points_[i]);
    }

    double heading_at(double distance) const {
        const std::size_t i = leg_at(distance);
        const Eigen::Vector2d leg = points_[i + 1] - points_[i];
        return std::atan2(leg.y(), leg.x());
    }

    /// The distance, from `from` on and no farther than `window`, at which the line is nearest.
    double nearest(const Point2& point, double from, double window) const {
        double best = from;
        double least = (at(from) - point).squaredNorm();
        for (std::size_t i = leg_at(from); i + 1 < points_.size(); ++i) {
            if (lengths_[i] > from + window) {
                break;
            }
            const Eigen::Vector2d leg = points_[i + 1] - points_[i];
            const double along = (point - points_[i]).dot(leg) / leg.norm();
            const double low = std::max(from, lengths_[i]);
            const double high = std::min(from + window, lengths_[i + 1]);
            const double distance = std::clamp(lengths_[i] + along, low, std::max(low, high));
            const double squared = (at(distance) - point).squaredNorm();
            if (squared < least) {
                least = squared;
                best = distance;
            }
        }
        return best;
    }

  private:
    std::size_t leg_at(double distance) const {
        const auto after = std::upper_bound(lengths_.begin(), lengths_.end(), distance);
        const auto i = static_cast<std::size_t>(after - lengths_.begin());
        return std::clamp<std::size_t>(i, 1, lengths_.size() - 1) - 1;
    }

    Points points_;
    std::vector<double> lengths_;  ///< from the start to each point
};

/// The circle through the robot, along its heading, and the target; a target that is behind is met
/// after the sharpest turn.
double curvature_to(const Point2& target_in_robot) {
    constexpr double kSharpest = 1e3;
    if (target_in_robot.x() <= 0.0) {
        return target_in_robot.y() < 0.0 ? -kSharpest : kSharpest;
    }
    return 2.0 * target_in_robot.y() / target_in_robot.squaredNorm();
}

/// How fast each place of the line may be passed, so that every bend is met slowly enough and the
/// end at a standstill.
class SpeedProfile {
  public:
    SpeedProfile(const Polyline& line, const VehicleConfig& vehicle,
                 const ForkliftDriveConfig& config) {
        const auto count = static_cast<std::size_t>(std::ceil(line.length() / kSpacing)) + 1;
        allowed_.resize(count);
        for (std::size_t i = 0; i < count; ++i) {
            const double along = static_cast<double>(i) * kSpacing;
            // Pure pursuit spreads a corner over about the distance that it looks ahead.
            const double turn = normalize_angle(line.heading_at(along + kLookAhead / 2.0) -
                                                line.heading_at(along - kLookAhead / 2.0));
            const double slow = config.turn_rate * kLookAhead / std::max(std::abs(turn), 1e-9);
            allowed_[i] = std::min(config.speed, slow);
        }
        allowed_.back() = 0.0;
        const double gain = 2.0 * kBraking * vehicle.acceleration * kSpacing;  // of speed squared
        for (std::size_t i = count - 1; i-- > 0;) {
            const double after = allowed_[i + 1];
            allowed_[i] = std::min(allowed_[i], std::sqrt(after * after + gain));
        }
    }

    double at(double along) const {
        const double place =
            std::clamp(along / kSpacing, 0.0, static_cast<double>(allowed_.size() - 1));
        const auto i = std::min(static_cast<std::size_t>(place), allowed_.size() - 2);
        const double ratio = place - static_cast<double>(i);
        return (1.0 - ratio) * allowed_[i] + ratio * allowed_[i + 1];
    }

  private:
    static constexpr double kSpacing = 0.05;  ///< metres
    static constexpr double kBraking = 0.8;   ///< share of the braking that is planned with
    std::vector<double> allowed_;             ///< m/s
};

class Driver {
  public:
    Driver(const Polyline& line, const VehicleConfig& vehicle, const ForkliftDriveConfig& config)
        : line_(line), vehicle_(vehicle), config_(config), profile_(line, vehicle, config) {}

    bool arrived() const { return line_.length() - along_ < kArrived; }

    DriveCommand command(const VehicleState& state) {
        const Pose2d& pose = state.world_from_robot;
        const double ahead = kLookAhead + kLookAheadTime * std::abs(state.speed);
        along_ = line_.nearest(pose.translation, along_, ahead);
        const double beyond = along_ + ahead - line_.length();
        Point2 target = line_.at(along_ + ahead);
        if (beyond > 0.0) {  // the line goes on behind its end, so that the end is met straight
            const double heading = line_.heading_at(line_.length());
            target += beyond * Point2(std::cos(heading), std::sin(heading));
        }
        const double curvature = curvature_to(pose.inverse() * target);
        DriveCommand command;
        command.steering = steering_for(vehicle_, curvature);
        // The bend that the wheel makes now counts as well as the one that is asked for.
        const double bend =
            std::max(std::abs(std::tan(state.steering)), std::abs(std::tan(command.steering))) /
            std::abs(vehicle_.wheelbase);
        // Pure pursuit begins a bend before the line does.
        command.speed = std::min({profile_.at(along_ + kLookAhead / 2.0), profile_.at(along_),
                                  config_.turn_rate / std::max(bend, 1e-6)});
        command.speed = std::max(command.speed, kCrawl);
        return command;
    }

  private:
    const Polyline& line_;
    VehicleConfig vehicle_;
    ForkliftDriveConfig config_;
    SpeedProfile profile_;
    double along_ = 0.0;  ///< metres of the line that lie behind
};

void stand_still(std::vector<VehicleState>& states) {
    const auto steps = static_cast<std::size_t>(kPause / kStep);
    states.insert(states.end(), steps, states.back());
}

}  // namespace

ForkliftDrive::ForkliftDrive(const Points& path, const VehicleConfig& vehicle,
                             const ForkliftDriveConfig& config)
    : vehicle_(vehicle) {
    const Polyline line(path);
    VehicleState state;
    state.world_from_robot = Pose2d(line.at(0.0), line.heading_at(0.0));
    states_.push_back(state);
    stand_still(states_);
    Driver driver(line, vehicle, config);
    const double longest = kPatience * (line.length() / config.speed + 60.0);
    for (double time = 0.0; !driver.arrived(); time += kStep) {
        if (time > longest) {
            throw Error("the vehicle cannot follow the path: its bends are too sharp");
        }
        state = step(vehicle, state, driver.command(state), kStep);
        states_.push_back(state);
    }
    while (state.speed != 0.0) {
        state = step(vehicle, state, {0.0, state.steering}, kStep);
        states_.push_back(state);
    }
    stand_still(states_);
}

double ForkliftDrive::duration() const {
    return static_cast<double>(states_.size() - 1) * kStep;
}

Pose2d ForkliftDrive::world_from_robot(double time) const {
    const double steps = std::clamp(time, 0.0, duration()) / kStep;
    const auto i = std::min(static_cast<std::size_t>(steps), states_.size() - 2);
    return interpolate(states_[i].world_from_robot, states_[i + 1].world_from_robot,
                       steps - static_cast<double>(i));
}

Eigen::Vector3d ForkliftDrive::twist(double time) const {
    const double steps = std::clamp(time, 0.0, duration()) / kStep;
    const auto i = std::min(static_cast<std::size_t>(steps), states_.size() - 2);
    return states_[i + 1].twist(vehicle_);
}

}  // namespace hybrid_slam
