// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/simulator/simulated_vehicle.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "checked_drive.hpp"
#include "forklift_drive.hpp"
#include "hybrid_slam/core/error.hpp"
#include "simulated_camera.hpp"
#include "simulated_s300.hpp"

namespace hybrid_slam {
namespace {

/// The path as often as the world's laps or the distance say.
Points driven_path(const World& world, const std::string& path_name, double distance) {
    const Points& path = world.path_named(path_name);
    Points driven;
    double length = 0.0;
    const auto append = [&](const Point2& point) {
        length += driven.empty() ? 0.0 : (point - driven.back()).norm();
        driven.push_back(point);
    };
    if (distance <= 0.0) {
        for (int lap = 0; lap < world.laps; ++lap) {
            std::for_each(path.begin(), path.end(), append);
        }
        return driven;
    }
    while (length < distance) {
        const double before = length;
        for (const Point2& point : path) {
            append(point);
            if (length >= distance) {
                const Eigen::Vector2d back = driven[driven.size() - 2] - point;
                driven.back() += (length - distance) / back.norm() * back;
                return driven;
            }
        }
        if (!(length > before)) {
            throw Error("world " + world.name + ": path needs two different points");
        }
    }
    return driven;
}

}  // namespace

struct SimulatedVehicle::State {
    State(World world_in, const std::string& path, const RobotConfig& robot,
          const SimulatedDriveConfig& config)
        : world(std::move(world_in)),
          drive(driven_path(world, path, config.distance), robot.vehicle,
                {config.speed, config.turn_rate}),
          lidar(world, drive, robot.lidar, config),
          robot_from_laser(robot.lidar.robot_from_laser()) {
        if (config.camera && robot.camera.enabled) {
            camera.emplace(world, drive, robot.camera, config);
            renderer.emplace(world, robot.camera, config);
        }
    }

    World world;
    ForkliftDrive drive;
    SimulatedS300 lidar;
    Pose2d robot_from_laser;
    std::optional<LidarBytes> next_bytes;
    double next_stamp = 0.0;  ///< of these
    std::optional<SimulatedCamera> camera;
    std::optional<MomentRenderer> renderer;
    Trajectory truth;
    double arrival = 0.0;  ///< of the newest event
};

SimulatedVehicle::SimulatedVehicle(World world, const std::string& path, const RobotConfig& robot,
                                   const SimulatedDriveConfig& config)
    : state_(std::make_unique<State>(std::move(world), path, robot, checked_drive(config, robot))) {
}
SimulatedVehicle::~SimulatedVehicle() = default;

std::optional<SensorEvent> SimulatedVehicle::next() {
    State& state = *state_;
    if (!state.next_bytes && state.lidar.next_end() <= state.drive.duration()) {
        state.next_stamp = state.lidar.next_stamp();
        state.next_bytes = state.lidar.next();
    }
    const bool image_left = state.camera && state.camera->next_stamp() <= state.drive.duration();
    if (!state.next_bytes && !image_left) {
        return std::nullopt;
    }
    if (image_left && (!state.next_bytes || state.camera->arrival() < state.next_bytes->arrival)) {
        state.arrival = state.camera->arrival();
        return SensorEvent(
            CameraFrame{state.arrival, state.renderer->render(state.camera->next())});
    }
    state.arrival = state.next_bytes->arrival;
    state.truth.push_back({state.next_stamp, state.drive.world_from_robot(state.next_stamp)});
    return SensorEvent(*std::exchange(state.next_bytes, std::nullopt));
}

double SimulatedVehicle::progress() const {
    return std::min(state_->arrival / state_->drive.duration(), 1.0);
}

const Trajectory& SimulatedVehicle::truth() const {
    return state_->truth;
}

double SimulatedVehicle::duration() const {
    return state_->drive.duration();
}

std::optional<StampedPose> SimulatedVehicle::first_crash() const {
    constexpr double kStep = 0.1;  // seconds
    const Point2 scanner = state_->robot_from_laser.translation;
    for (double time = 0.0; time < duration(); time += kStep) {
        const Pose2d pose = state_->drive.world_from_robot(time);
        const Eigen::Vector2d reach = pose.rotation() * scanner;
        if (reach.norm() > 0.0 &&
            state_->world.cast_ray(pose.translation, reach.normalized()) < reach.norm()) {
            return StampedPose{time, pose};
        }
    }
    return std::nullopt;
}

void describe(ConfigSchema& schema, SimulatedDriveConfig& config) {
    schema.add("speed", config.speed, 0.01, 10.0, "m/s");
    schema.add("turn_rate", config.turn_rate, 0.01, 10.0, "rad/s at most");
    schema.add("distance", config.distance, 0.0, 1e5,
               "m, the path again and again; 0 = the world's laps of it");
    schema.add("range_sigma", config.range_sigma, 0.0, 1.0, "m, Gaussian, per beam");
    schema.add("range_bias", config.range_bias, -1.0, 1.0, "m, of all ranges");
    schema.add("dropout", config.dropout, 0.0, 1.0, "probability that a beam returns nothing");
    schema.add("protective_radius", config.protective_radius, 0.0, 30.0,
               "m, nearer returns are flagged as in the protective field");
    schema.add("clock_error", config.clock_error, 0.0, 0.01,
               "share by which the scanner's clock is wrong at most");
    schema.add("lidar_jitter", config.lidar_jitter, 0.0, 0.5, "s by which bytes are late at most");
    schema.add("camera_jitter", config.camera_jitter, 0.0, 0.5,
               "s by which images are late at most");
    schema.add("camera", config.camera, "whether there are images");
    schema.add("seed", config.seed, 0, 1000000000, "of all random numbers");
    const ConfigSchema::Section section(schema, "render");
    describe(schema, config.render);
}

}  // namespace hybrid_slam
