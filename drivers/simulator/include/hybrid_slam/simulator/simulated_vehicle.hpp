// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/core/trajectory.hpp"
#include "hybrid_slam/sensors/robot.hpp"
#include "hybrid_slam/sensors/sensor_event.hpp"
#include "hybrid_slam/simulator/render_config.hpp"
#include "hybrid_slam/simulator/world.hpp"

namespace hybrid_slam {

/// A drive of a simulated forklift and the faults of its sensors.
struct SimulatedDriveConfig {
    double speed = 0.3;         ///< m/s; the thesis drives at this
    double turn_rate = 0.5;     ///< rad/s at most; bends are driven more slowly
    double distance = 0.0;      ///< metres, the path again and again; 0 = the world's laps of it
    double range_sigma = 0.02;  ///< metres, Gaussian, per beam
    double range_bias = 0.0;    ///< metres, of all ranges
    double dropout = 0.002;     ///< probability that a beam returns nothing
    double protective_radius =
        0.4;                      ///< metres; nearer returns are flagged as in the protective field
    double clock_error = 0.001;   ///< the scanner's clock is wrong by up to this share
    double lidar_jitter = 0.003;  ///< seconds by which bytes are late at most
    double camera_jitter = 0.002;  ///< seconds by which images are late at most
    bool camera = true;
    RenderConfig render;
    int seed = 1;
};

/// Lists the keys without a section before them; render.* is a section within.
void describe(ConfigSchema& schema, SimulatedDriveConfig& config);

/// Sets what the section `drive:` of a world file names. Throws Error with the file, line and key.
void read_drive_section(const std::filesystem::path& world_file, SimulatedDriveConfig& config);

/// A forklift that is driven along a path of a world, from standstill to standstill, with a lidar
/// that speaks S300 telegrams and a camera that gives JPEG images, as they arrive at the computer:
/// the same bytes as live devices give. Each beam is cast from where the scanner is at its time.
/// Arrivals begin near 0 s. Seeded: the same input gives the same bytes.
class SimulatedVehicle : public SensorStream {
  public:
    /// `path` as of World::path_named. Throws Error for a path that cannot be driven and for a
    /// config out of range.
    SimulatedVehicle(World world, const std::string& path, const RobotConfig& robot,
                     const SimulatedDriveConfig& config);
    ~SimulatedVehicle() override;

    std::optional<SensorEvent> next() override;
    double progress() const override;

    /// True poses world_from_robot at the first beams of the scans yielded so far.
    const Trajectory& truth() const;
    double duration() const;  ///< seconds of the whole drive
    /// When and where the vehicle first reaches through a wall or a post with its scanner: the path
    /// is too narrow for it, and what the scanner sees then makes no sense.
    std::optional<StampedPose> first_crash() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
