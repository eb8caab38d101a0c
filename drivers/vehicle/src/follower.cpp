// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vehicle/follower.hpp"

#include <algorithm>
#include <cmath>

#include "hybrid_slam/core/error.hpp"
#include "pose_keeping.hpp"

namespace hybrid_slam {
namespace {

constexpr double kStanding = 1e-3;   ///< m/s
constexpr double kCreeping = 0.02;   ///< m/s, slower than which a vehicle is not asked to go
constexpr double kStopShort = 2e-3;  ///< metres before a stop at which it is called reached
constexpr double kPreview = 0.5;     ///< metres ahead that the wheel is readied for
constexpr double kPreviewStep = 0.05;
constexpr double kSearch = 0.5;  ///< metres around the last place in which the next one is sought
constexpr double kWheelShare = 0.7;  ///< of the steering rate that the speed is planned with

/// Where the vehicle is on its leg.
struct Progress {
    std::size_t segment = 0;
    double travelled = 0.0;  ///< metres from the start of the way; may lie beyond the leg's ends
    Pose2d robot_seen;       ///< the vehicle in the frame of the way there
};

class Leg {
  public:
    Leg(const Route& route, const FollowerState& state)
        : points_(route.points), begin_(state.leg_begin), end_(state.leg_end) {}

    int direction() const { return points_[begin_].direction; }
    double end() const { return points_[end_].travelled; }

    /// The nearest place of the leg, not far from where the vehicle was last.
    Progress find(const Pose2d& robot, std::size_t from) const {
        Progress best;
        double nearest = std::numeric_limits<double>::infinity();
        const double around = points_[from].travelled;
        for (std::size_t i = begin_; i < end_; ++i) {
            if (points_[i + 1].travelled < around - kSearch ||
                points_[i].travelled > around + kSearch) {
                continue;
            }
            const Progress progress = project(robot, i);
            const double away = progress.robot_seen.translation.norm();
            if (away < nearest) {
                nearest = away;
                best = progress;
            }
        }
        return best;
    }

    /// Of the way, the mean around a place; before and behind the leg it goes on as at its end.
    double mean_curvature(double travelled, double window) const {
        const double low = travelled - window / 2.0;
        const double high = travelled + window / 2.0;
        return direction() * normalize_angle(heading_at(high) - heading_at(low)) / window;
    }

  private:
    Progress project(const Pose2d& robot, std::size_t i) const {
        const PathPoint& from = points_[i];
        const double length = points_[i + 1].travelled - from.travelled;
        double along = from.direction * between(from.map_from_robot, robot).translation.x();
        // Beyond its ends the leg goes on, so that overrunning and starting short are seen.
        along = std::clamp(along, i == begin_ ? -kSearch : 0.0,
                           i + 1 == end_ ? length + kSearch : length);
        Progress progress;
        progress.segment = i;
        progress.travelled = from.travelled + along;
        progress.robot_seen = between(pose_at(i, along), robot);
        return progress;
    }

    Pose2d pose_at(std::size_t i, double along) const {
        const double way = points_[i].direction * along;
        return points_[i].map_from_robot * Pose2d::exp({way, 0.0, way * points_[i].curvature});
    }

    double heading_at(double travelled) const {
        const auto next = std::upper_bound(
            points_.begin() + static_cast<std::ptrdiff_t>(begin_) + 1,
            points_.begin() + static_cast<std::ptrdiff_t>(end_), travelled,
            [](double value, const PathPoint& point) { return value < point.travelled; });
        const PathPoint& from = *(next - 1);
        return from.map_from_robot.heading +
               from.direction * from.curvature * (travelled - from.travelled);
    }

    const std::vector<PathPoint>& points_;
    std::size_t begin_;
    std::size_t end_;
};

void check(const Route& route, const FollowerState& state, const FollowerInput& input) {
    if (route.status != PlanStatus::kFound || route.points.empty()) {
        throw Error("follower: there is no way to follow");
    }
    if (state.leg_end >= route.points.size()) {
        throw Error("follower: its state is that of another way");
    }
    if (!(input.seconds > 0.0)) {
        throw Error("follower: a time step must be positive");
    }
}

/// The next stop on the way: a change of direction, a waypoint where that is wished, the end.
std::size_t stop_after(const Route& route, std::size_t begin, bool stop_at_each) {
    const auto& ends = route.waypoint_ends;
    for (std::size_t i = begin + 1; i + 1 < route.points.size(); ++i) {
        const bool is_waypoint =
            stop_at_each && std::find(ends.begin(), ends.end(), i) != ends.end();
        if (is_waypoint || route.points[i].direction != route.points[begin].direction) {
            return i;
        }
    }
    return route.points.size() - 1;
}

void begin_leg(const Route& route, const FollowerConfig& config, FollowerState& state) {
    state.leg_begin = state.leg_end;
    state.leg_end = stop_after(route, state.leg_begin, config.stop_at_each);
    state.segment = state.leg_begin;
    state.turning_wheel = true;
    state.stopping = false;
}

/// A leg that is over is followed by the next one; after the last one the place is judged.
void end_leg(const Route& route, const FollowerConfig& config, FollowerState& state) {
    if (!state.stopping || std::abs(state.vehicle.speed) > kStanding) {
        return;
    }
    if (state.leg_end + 1 < route.points.size()) {
        begin_leg(route, config, state);
        return;
    }
    const Point2 missed =
        route.points.back().map_from_robot.translation - state.vehicle.world_from_robot.translation;
    state.finished = missed.norm() <= config.arrival_tolerance;
    state.off_path = !state.finished;
}

struct Wish {
    double speed = 0.0;  ///< m/s, not negative
    double steering = 0.0;
};

/// The speed with which the wheel gets in time to where the way wants it.
double wheel_speed(const VehicleConfig& vehicle, const FollowerConfig& config,
                   const FollowerState& state, const Leg& leg, double travelled) {
    double speed = std::min(config.speed_limit, vehicle.speed_limit);
    for (double ahead = kPreviewStep; ahead < kPreview; ahead += kPreviewStep) {
        if (travelled + ahead > leg.end()) {
            break;
        }
        const double curvature = leg.mean_curvature(travelled + ahead, config.steering_window);
        const double turn = std::abs(steering_for(vehicle, curvature) - state.vehicle.steering);
        if (speed * turn > ahead * kWheelShare * vehicle.steering_rate) {
            speed = ahead * kWheelShare * vehicle.steering_rate / turn;
        }
    }
    return speed;
}

Wish wish_for(const VehicleConfig& vehicle, const FollowerConfig& config,
              const FollowerState& state, const Leg& leg, const Progress& progress) {
    const double c = config.convergence;
    const double curvature = leg.mean_curvature(progress.travelled, config.steering_window) -
                             progress.robot_seen.y() / (c * c) -
                             2.0 * leg.direction() * progress.robot_seen.heading / c;
    Wish wish;
    wish.steering = steering_for(vehicle, curvature);
    wish.speed = wheel_speed(vehicle, config, state, leg, progress.travelled);
    if (wish.speed * std::abs(curvature) > config.turn_rate_limit) {
        wish.speed = config.turn_rate_limit / std::abs(curvature);
    }
    const double error = std::abs(wish.steering - state.vehicle.steering);
    wish.speed *= std::max(0.2, 1.0 - error / config.wheel_far);
    const double remaining = std::max(0.0, leg.end() - progress.travelled);
    wish.speed = std::min(wish.speed, std::sqrt(2.0 * config.braking * remaining));
    wish.speed = std::max(wish.speed, kCreeping);
    return wish;
}

/// Whether the wheel must be turned before the vehicle goes on.
bool must_turn_wheel(const FollowerConfig& config, const FollowerState& state, const Wish& wish) {
    const double error = std::abs(wish.steering - state.vehicle.steering);
    return error > (state.turning_wheel ? config.wheel_tolerance : config.wheel_far);
}

void count_waypoints(const Route& route, FollowerState& state, double travelled) {
    const std::size_t count = route.waypoint_ends.size();
    while (state.waypoints_reached + 1 < count &&
           route.points[route.waypoint_ends[state.waypoints_reached]].travelled <= travelled) {
        ++state.waypoints_reached;
    }
    if (state.finished) {
        state.waypoints_reached = count;
    }
}

bool is_off(const FollowerConfig& config, const Progress& progress) {
    return progress.robot_seen.translation.norm() > config.off_path ||
           std::abs(progress.robot_seen.heading) > radians(45.0);
}

/// The speed from which the vehicle can stop before what is in the way; 0 when it must not go.
double free_speed(const FollowerConfig& config, const FollowerInput& input, int direction) {
    const double free_way = direction > 0 ? input.free_ahead : input.free_behind;
    const double gap = free_way - config.obstacle_gap;
    // Put so that NaN stands still.
    return !input.hold && gap > 0.0 ? std::sqrt(2.0 * config.braking * gap) : 0.0;
}

/// What every part of a step looks at.
struct Step {
    const Route& route;
    const VehicleConfig& vehicle;
    const FollowerConfig& config;
    const FollowerInput& input;
    FollowerState& state;
};

/// The command and the status of a vehicle that is not yet where it should be.
void command(const Step& now, const Leg& leg, const Progress& progress, FollowerStep& result) {
    const Wish wish = wish_for(now.vehicle, now.config, now.state, leg, progress);
    now.state.turning_wheel = must_turn_wheel(now.config, now.state, wish);
    now.state.stopping = now.state.stopping || leg.end() - progress.travelled <=
                                                   kStopShort + wish.speed * now.input.seconds;
    result.command.steering = wish.steering;
    const double most = free_speed(now.config, now.input, leg.direction());
    if (most == 0.0) {
        result.status = FollowerStatus::kHeld;
    } else if (now.state.turning_wheel) {
        result.status = FollowerStatus::kTurningWheel;
    } else {
        result.status = FollowerStatus::kDriving;
        result.command.speed =
            now.state.stopping ? 0.0 : leg.direction() * std::min(wish.speed, most);
    }
}

void go_on(const Step& now, FollowerStep& result) {
    FollowerState& state = now.state;
    if (state.leg_end == 0) {
        begin_leg(now.route, now.config, state);
    }
    if (!state.finished && !state.off_path) {
        end_leg(now.route, now.config, state);
    }
    const Leg leg(now.route, state);
    const Progress progress = leg.find(state.vehicle.world_from_robot, state.segment);
    state.segment = progress.segment;
    result.remaining = std::max(0.0, now.route.length - progress.travelled);
    result.cross_track = progress.robot_seen.y();
    result.heading_error = progress.robot_seen.heading;
    state.off_path = state.off_path || (!state.finished && is_off(now.config, progress));
    if (!state.finished && !state.off_path) {
        command(now, leg, progress, result);
    }
    count_waypoints(now.route, state, progress.travelled);
}

}  // namespace

void describe(ConfigSchema& schema, FollowerConfig& config) {
    schema.add("speed_limit", config.speed_limit, 0.01, 10.0, "m/s");
    schema.add_degrees("turn_rate_limit_deg", config.turn_rate_limit, 0.1, 360.0,
                       "deg per second of the vehicle; slower where the way bends");
    schema.add("braking", config.braking, 0.01, 10.0,
               "m/s^2 that is planned; the vehicle must do better");
    schema.add("convergence", config.convergence, 0.05, 10.0,
               "m; three of it leave a fifth of a deviation");
    schema.add("steering_window", config.steering_window, 0.01, 2.0,
               "m over which a step of the curvature is spread");
    schema.add_degrees("wheel_tolerance_deg", config.wheel_tolerance, 0.01, 45.0,
                       "deg, of the wheel before the vehicle starts");
    schema.add_degrees("wheel_far_deg", config.wheel_far, 0.1, 90.0,
                       "deg, of the wheel; more: stop and turn it");
    schema.add("pose_trust", config.pose_trust, 0.01, 1.0,
               "share of a pose's difference that is believed");
    schema.add("pose_jump", config.pose_jump, 0.01, 100.0,
               "m; a pose farther off is believed at once");
    schema.add("off_path", config.off_path, 0.01, 10.0, "m beside the way that need another plan");
    schema.add("arrival_tolerance", config.arrival_tolerance, 0.001, 10.0,
               "m, of the place where it stops in the end");
    schema.add("obstacle_gap", config.obstacle_gap, 0.0, 10.0, "m kept to an obstacle on the way");
    schema.add("stop_at_each", config.stop_at_each,
               "stop at each waypoint; else those before the last are only passed");
}

FollowerState begin_route(const FollowerState& before) {
    FollowerState state;
    state.vehicle = before.vehicle;
    state.command = before.command;
    state.recent = before.recent;
    state.has_pose = before.has_pose;
    return state;
}

FollowerStep follow(const Route& route, const VehicleConfig& vehicle, const FollowerConfig& config,
                    FollowerState& state, const FollowerInput& input) {
    check(route, state, input);
    keep_pose(vehicle, config, state, input);
    FollowerStep result;
    result.map_from_robot = state.vehicle.world_from_robot;
    result.command.steering = state.command.steering;
    result.remaining = route.length;
    if (state.has_pose && route.points.size() > 1) {
        go_on({route, vehicle, config, input, state}, result);
    } else if (state.has_pose) {
        state.finished = true;  // there is no way to go
        count_waypoints(route, state, 0.0);
    }
    if (state.finished) {
        result.status = FollowerStatus::kArrived;
    } else if (state.off_path) {
        result.status = FollowerStatus::kOffPath;
    }
    result.waypoints_reached = state.waypoints_reached;
    state.command = result.command;
    return result;
}

}  // namespace hybrid_slam
