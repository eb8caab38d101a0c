// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "hybrid_slam/can/can_frame.hpp"
#include "hybrid_slam/core/trajectory.hpp"
#include "hybrid_slam/lidar/lidar_reader.hpp"
#include "hybrid_slam/sensors/robot.hpp"
#include "hybrid_slam/simulator/camera_moment.hpp"
#include "hybrid_slam/simulator/simulated_vehicle.hpp"
#include "hybrid_slam/simulator/world.hpp"
#include "hybrid_slam/vehicle/forklift.hpp"

namespace hybrid_slam {

/// The vehicle's outline began to reach into something. It goes on through it all the same.
struct TruckContact {
    double time = 0.0;  ///< seconds
    Pose2d world_from_robot;
    Point2 at;         ///< metres, in the world
    std::string with;  ///< "wall 3", "post 0", "person 1": by their order in the world
};

/// A forklift in a world that goes where CAN frames tell it, with the sensors of a
/// SimulatedVehicle. The clock is the caller's and begins at 0 s; nothing waits. The same frames at
/// the same times and the same seed give the same bytes.
class TruckWorld {
  public:
    /// What has happened in a while.
    struct Events {
        std::vector<CanFrame> frames;        ///< that the truck sent
        std::vector<LidarBytes> lidar;       ///< that arrived, in the order of arrival
        std::vector<CameraMoment> images;    ///< that were exposed: they arrive later
        std::vector<TruckContact> contacts;  ///< that began
    };

    /// The truck's bus is robot.can.layout's. Of `config` the faults of the sensors count, not how
    /// a path is driven. Throws Error for what cannot be simulated.
    TruckWorld(World world, const RobotConfig& robot, const SimulatedDriveConfig& config,
               const Pose2d& world_from_start);
    ~TruckWorld();
    TruckWorld(const TruckWorld&) = delete;
    TruckWorld& operator=(const TruckWorld&) = delete;

    /// Moves on to `now` seconds. A time that is not later changes nothing.
    Events advance(double now);
    /// A frame of the bus that arrives now; the result is the truck's answer.
    std::vector<CanFrame> receive(const CanFrame& frame);

    double now() const;  ///< seconds
    const VehicleState& state() const;
    bool driven() const;         ///< power is on and commands are fresh
    double distance() const;     ///< metres driven, forwards and backwards
    double worst_speed() const;  ///< m/s, either way
    /// True poses world_from_robot at the first beams of the scans that have arrived.
    const Trajectory& truth() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
