// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/simulator/truck_world.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <utility>

#include "checked_drive.hpp"
#include "footprint.hpp"
#include "hybrid_slam/can/truck_can.hpp"
#include "recorded_motion.hpp"
#include "simulated_camera.hpp"
#include "simulated_s300.hpp"

namespace hybrid_slam {
namespace {

/// Seconds between two states that are kept and looked at for contact; counted from 0 s whatever
/// the caller's steps are, so that these do not matter.
constexpr double kRecordEvery = 0.005;

VehicleState standing_at(const Pose2d& world_from_robot) {
    VehicleState state;
    state.world_from_robot = world_from_robot;
    return state;
}

}  // namespace

struct TruckWorld::State {
    State(World world_in, const RobotConfig& robot, const SimulatedDriveConfig& config,
          const Pose2d& start)
        : world(std::move(world_in)),
          truck(robot.can.layout, robot.vehicle, standing_at(start), 0.0),
          motion(robot.vehicle),
          footprint(robot.vehicle),
          lidar(world, motion, robot.lidar, config) {
        if (config.camera && robot.camera.enabled) {
            camera.emplace(world, motion, robot.camera, config);
        }
        motion.record(0.0, truck.state());
    }

    void move_to(double time, Events& events);
    void record(double time, Events& events);
    void look_for_contact(double time, Events& events);
    void sense(Events& events);
    void hand_out(Events& events);

    struct Scan {
        LidarBytes bytes;
        StampedPose truth;
    };

    World world;
    TruckCan truck;
    RecordedMotion motion;
    Footprint footprint;
    SimulatedS300 lidar;
    std::optional<SimulatedCamera> camera;
    std::deque<Scan> on_the_wire;
    Trajectory truth;
    bool in_contact = false;
    double now = 0.0;
    double distance = 0.0;
    double worst_speed = 0.0;
    std::uint64_t records = 0;
};

void TruckWorld::State::move_to(double time, Events& events) {
    const std::vector<CanFrame> frames = truck.advance(time);
    events.frames.insert(events.frames.end(), frames.begin(), frames.end());
    now = time;
}

void TruckWorld::State::record(double time, Events& events) {
    const Pose2d before = motion.world_from_robot(motion.newest());
    motion.record(time, truck.state());
    // An arc of some millimetres is as long as its chord.
    distance += (truck.state().world_from_robot.translation - before.translation).norm();
    worst_speed = std::max(worst_speed, std::abs(truck.state().speed));
    look_for_contact(time, events);
}

void TruckWorld::State::look_for_contact(double time, Events& events) {
    const Pose2d& pose = truck.state().world_from_robot;
    const std::optional<Obstacle> obstacle = touched(world, world.people_at(time), footprint, pose);
    if (obstacle && !in_contact) {
        events.contacts.push_back({time, pose, obstacle->at, obstacle->name});
    }
    in_contact = obstacle.has_value();
}

/// What the recorded motion is long enough for.
void TruckWorld::State::sense(Events& events) {
    while (lidar.next_end() <= motion.newest()) {
        const double stamp = lidar.next_stamp();
        const StampedPose pose{stamp, motion.world_from_robot(stamp)};
        on_the_wire.push_back({lidar.next(), pose});
    }
    while (camera && camera->next_stamp() <= motion.newest()) {
        events.images.push_back(camera->next());
    }
}

void TruckWorld::State::hand_out(Events& events) {
    while (!on_the_wire.empty() && on_the_wire.front().bytes.arrival <= now) {
        truth.push_back(on_the_wire.front().truth);
        events.lidar.push_back(std::move(on_the_wire.front().bytes));
        on_the_wire.pop_front();
    }
}

TruckWorld::TruckWorld(World world, const RobotConfig& robot, const SimulatedDriveConfig& config,
                       const Pose2d& world_from_start)
    : state_(std::make_unique<State>(std::move(world), robot, checked_drive(config, robot),
                                     world_from_start)) {}
TruckWorld::~TruckWorld() = default;

TruckWorld::Events TruckWorld::advance(double now) {
    State& state = *state_;
    Events events;
    for (;;) {
        const double next_record = kRecordEvery * static_cast<double>(state.records + 1);
        if (next_record > now) {
            break;
        }
        state.move_to(next_record, events);
        state.record(next_record, events);
        ++state.records;
        state.sense(events);
    }
    if (now > state.now) {
        state.move_to(now, events);
    }
    state.hand_out(events);
    return events;
}

std::vector<CanFrame> TruckWorld::receive(const CanFrame& frame) {
    return state_->truck.receive(frame, state_->now);
}

double TruckWorld::now() const {
    return state_->now;
}

const VehicleState& TruckWorld::state() const {
    return state_->truck.state();
}

bool TruckWorld::driven() const {
    return state_->truck.driven();
}

double TruckWorld::distance() const {
    return state_->distance;
}

double TruckWorld::worst_speed() const {
    return state_->worst_speed;
}

const Trajectory& TruckWorld::truth() const {
    return state_->truth;
}

}  // namespace hybrid_slam
