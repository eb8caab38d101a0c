// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/core/source.hpp"
#include "hybrid_slam/core/trajectory.hpp"
#include "hybrid_slam/simulator/world.hpp"

namespace hybrid_slam {

struct SimulatorConfig {
    double speed = 0.5;                        ///< m/s along the path
    double turn_rate = 0.5;                    ///< rad/s at most
    double scan_rate = 12.5;                   ///< Hz
    double field_of_view = kPi;                ///< radians, centred ahead
    double angle_increment = kPi / 360.0;      ///< radians
    double range_max = 29.5;                   ///< metres
    double range_sigma = 0.01;                 ///< metres, Gaussian, per beam
    double range_resolution = 0.01;            ///< metres; 0 = not quantised
    double dropout = 0.002;                    ///< probability that a beam returns nothing
    double odometry_translation_sigma = 0.02;  ///< of the run's scale, and noise in m per sqrt(m)
    double odometry_rotation_sigma = 0.02;  ///< of the run's scale, and noise in rad per sqrt(rad)
    double odometry_drift_sigma = 0.01;     ///< heading noise in rad per sqrt(m) driven
    int seed = 1;
};

/// Lists the keys without a section before them ("speed"); open one around it.
void describe(ConfigSchema& schema, SimulatorConfig& config);

/// Sets what the section `simulator:` of a world file names. Throws Error with the file, line and
/// key.
void read_simulator_section(const std::filesystem::path& world_file, SimulatorConfig& config);

/// Drives the path of a world, rounding its corners, and yields wheel odometry and scans. The scan
/// of a step is taken from one place (no motion within a sweep), the laser sits at the robot's
/// origin, and a beam that hits nothing reads infinity. Before each scan comes the wheel odometry
/// of its stamp, which begins at zero. Stamps begin at 0 s. Seeded: the same input gives the same
/// bytes.
class Simulator : public Source {
  public:
    /// Throws Error for a path of fewer than two different points and a config out of range.
    Simulator(World world, const SimulatorConfig& config);
    ~Simulator() override;

    std::optional<Measurement> next() override;
    double progress() const override;

    /// True poses world_from_robot at the stamps of the scans yielded so far.
    const Trajectory& truth() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
