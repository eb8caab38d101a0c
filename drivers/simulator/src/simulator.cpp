// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/simulator/simulator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "drive.hpp"
#include "fan_caster.hpp"
#include "hybrid_slam/core/error.hpp"
#include "noise.hpp"

namespace hybrid_slam {
namespace {

constexpr double kRangeMin = 0.05;  ///< metres
/// The wheels' noise has its own generator, so that another lidar does not change the odometry.
constexpr std::uint64_t kWheelStream = std::uint64_t{1} << 32;

BeamFan fan_of(const SimulatorConfig& config) {
    const double steps = std::round(config.field_of_view / config.angle_increment);
    BeamFan fan;
    fan.angle_increment = config.angle_increment;
    fan.angle_min = -steps * config.angle_increment / 2.0;
    fan.beams = static_cast<std::size_t>(steps) + 1;
    return fan;
}

/// Wheel odometry of one run: its scales are wrong by the same amounts all along, and each step
/// adds noise whose variance grows with what was driven and turned.
class WheelModel {
  public:
    WheelModel(const SimulatorConfig& config, Pose2d world_from_start)
        : config_(config),
          noise_(kWheelStream + static_cast<std::uint64_t>(config.seed)),
          translation_scale_(1.0 + config.odometry_translation_sigma * noise_.gauss()),
          rotation_scale_(1.0 + config.odometry_rotation_sigma * noise_.gauss()),
          world_from_robot_(std::move(world_from_start)) {}

    Pose2d move_to(const Pose2d& world_from_robot) {
        const Pose2d step = between(world_from_robot_, world_from_robot);
        world_from_robot_ = world_from_robot;
        const double driven = step.translation.norm();
        const double turned = std::abs(step.heading);
        // A sigma of s per square root of a metre, over d metres, as a share of those d metres.
        double scale = translation_scale_;
        if (driven > 0.0) {
            scale += config_.odometry_translation_sigma / std::sqrt(driven) * noise_.gauss();
        }
        double heading = step.heading * rotation_scale_;
        heading += config_.odometry_rotation_sigma * std::sqrt(turned) * noise_.gauss();
        heading += config_.odometry_drift_sigma * std::sqrt(driven) * noise_.gauss();
        const Pose2d measured(step.translation * scale, heading);
        odom_from_robot_ = odom_from_robot_ * measured;
        return odom_from_robot_;
    }

  private:
    SimulatorConfig config_;
    Noise noise_;
    double translation_scale_;
    double rotation_scale_;
    Pose2d world_from_robot_;
    Pose2d odom_from_robot_;
};

}  // namespace

struct Simulator::State {
    State(World world_in, const SimulatorConfig& config_in)
        : world(std::move(world_in)),
          config(config_in),
          fan(fan_of(config)),
          drive(world, config.speed, config.turn_rate),
          range_noise(static_cast<std::uint64_t>(config.seed)),
          wheels(config, drive.world_from_robot(0.0)),
          steps(static_cast<std::size_t>(drive.duration() * config.scan_rate) + 1) {}

    Scan take_scan(double stamp, const Pose2d& world_from_robot);
    float read_range(double distance);

    World world;
    SimulatorConfig config;
    BeamFan fan;
    Drive drive;
    Noise range_noise;
    WheelModel wheels;
    std::size_t steps;     ///< scans in the whole drive
    std::size_t step = 0;  ///< scans begun
    std::optional<Scan> scan;
    Trajectory truth;
};

float Simulator::State::read_range(double distance) {
    // Both numbers are drawn for every beam, so that the noise of one does not depend on the
    // others.
    const bool dropped = range_noise.uniform() <= config.dropout;
    double range = distance + config.range_sigma * range_noise.gauss();
    if (config.range_resolution > 0.0) {
        range = std::round(range / config.range_resolution) * config.range_resolution;
    }
    const bool no_return = dropped || !(distance < config.range_max);
    return no_return ? std::numeric_limits<float>::infinity() : static_cast<float>(range);
}

Scan Simulator::State::take_scan(double stamp, const Pose2d& world_from_robot) {
    Scan made;
    made.stamp = stamp;
    made.angle_min = fan.angle_min;
    made.angle_increment = fan.angle_increment;
    made.range_min = kRangeMin;
    made.range_max = config.range_max;
    const MovingLaser laser{world_from_robot, world_from_robot};  // no motion within a sweep
    for (const double distance : cast_fan(world, laser, fan, world.people_at(stamp))) {
        made.ranges.push_back(read_range(distance));
    }
    return made;
}

void describe(ConfigSchema& schema, SimulatorConfig& config) {
    schema.add("speed", config.speed, 0.01, 20.0, "m/s along the path");
    schema.add("turn_rate", config.turn_rate, 0.01, 20.0, "rad/s at most");
    schema.add("scan_rate", config.scan_rate, 0.1, 1000.0, "Hz");
    schema.add("field_of_view", config.field_of_view, 0.01, 2.0 * kPi, "rad, centred ahead");
    schema.add("angle_increment", config.angle_increment, 1e-4, kPi, "rad between beams");
    schema.add("range_max", config.range_max, 0.1, 1000.0, "m");
    schema.add("range_sigma", config.range_sigma, 0.0, 1.0, "m, Gaussian, per beam");
    schema.add("range_resolution", config.range_resolution, 0.0, 1.0, "m; 0 = not quantised");
    schema.add("dropout", config.dropout, 0.0, 1.0, "probability that a beam returns nothing");
    schema.add("odometry_translation_sigma", config.odometry_translation_sigma, 0.0, 1.0,
               "of the run's scale, and noise in m per sqrt(m)");
    schema.add("odometry_rotation_sigma", config.odometry_rotation_sigma, 0.0, 1.0,
               "of the run's scale, and noise in rad per sqrt(rad)");
    schema.add("odometry_drift_sigma", config.odometry_drift_sigma, 0.0, 1.0,
               "heading noise in rad per sqrt(m)");
    schema.add("seed", config.seed, 0, std::numeric_limits<int>::max(), "of all random numbers");
}

Simulator::Simulator(World world, const SimulatorConfig& config) {
    SimulatorConfig checked = config;
    ConfigSchema schema;
    describe(schema, checked);  // throws when a value is out of range
    state_ = std::make_unique<State>(std::move(world), config);
}

Simulator::~Simulator() = default;

std::optional<Measurement> Simulator::next() {
    State& state = *state_;
    if (state.scan) {
        state.truth.push_back({state.scan->stamp, state.drive.world_from_robot(state.scan->stamp)});
        std::optional<Measurement> scan(std::move(*state.scan));
        state.scan.reset();
        return scan;
    }
    if (state.step == state.steps) {
        return std::nullopt;
    }
    const double stamp = static_cast<double>(state.step) / state.config.scan_rate;
    const Pose2d world_from_robot = state.drive.world_from_robot(stamp);
    ++state.step;
    state.scan = state.take_scan(stamp, world_from_robot);
    return WheelOdometry{stamp, state.wheels.move_to(world_from_robot)};
}

double Simulator::progress() const {
    return static_cast<double>(state_->step) / static_cast<double>(state_->steps);
}

const Trajectory& Simulator::truth() const {
    return state_->truth;
}

}  // namespace hybrid_slam
