// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "device_news.hpp"
#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/live/live_sensors.hpp"
#include "input.hpp"

namespace CLI {
class App;
}

namespace hybrid_slam::tools {

/// Which vehicle, and what of its file to change.
struct RobotOptions {
    std::filesystem::path robot;  ///< empty: the defaults
    std::string lidar;            ///< in place of lidar.port
    std::string camera;           ///< in place of camera.device
    bool no_camera = false;
    std::string clock;  ///< of a simulator in lockstep; empty: real time
};
void add_robot_options(CLI::App& command, RobotOptions& options);
RobotConfig robot_of(const RobotOptions& options);

/// Live devices until a signal comes; says in messages when one of them comes, goes or is silent.
class LiveStream : public SensorStream {
  public:
    explicit LiveStream(const RobotConfig& robot, const LiveOptions& options = {});

    std::optional<SensorEvent> next() override;
    /// Says when no scans come of what this stream gives to the source.
    void watch(const SensorSource& source) { source_ = &source; }
    LiveStatus status() const { return sensors_.status(); }
    double now() const { return sensors_.now(); }

  private:
    LiveSensors sensors_;
    DeviceNews news_;
    const SensorSource* source_ = nullptr;
    Stopwatch clock_;
};

/// Live devices as the input of a session; with a clock, those of a simulator in lockstep.
struct LiveInputOptions {
    std::string clock;  ///< of a simulator in lockstep; empty: real time
    /// Somebody drives by it: rather leave images out than let scans wait behind them.
    bool prompt = false;
};
std::unique_ptr<Input> open_live_input(const RobotConfig& robot, bool images,
                                       const LiveInputOptions& options = {});
/// --clock
void add_clock_option(CLI::App& command, std::string& clock);

}  // namespace hybrid_slam::tools
