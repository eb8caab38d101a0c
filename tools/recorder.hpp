// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "device_news.hpp"
#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/live/live_sensors.hpp"
#include "hybrid_slam/recording/recording.hpp"
#include "hybrid_slam/sensors/sensor_source.hpp"

namespace hybrid_slam::tools {

/// A line on standard error that is drawn again and again; none when that is no terminal.
class StatusLine {
  public:
    explicit StatusLine(bool quiet);
    ~StatusLine() { clear(); }
    StatusLine(const StatusLine&) = delete;
    StatusLine& operator=(const StatusLine&) = delete;

    bool visible() const { return visible_; }
    void draw(const std::string& text);
    void clear();  ///< before anything else is printed

  private:
    bool visible_;
    bool drawn_ = false;
};

/// How many a second came lately.
class RateMeter {
  public:
    void look(double now, std::size_t count);
    double rate() const;  ///< Hz, over the last seconds

  private:
    std::deque<std::pair<double, std::size_t>> looks_;
};

/// What was recorded in the end.
struct RecordingSummary {
    std::filesystem::path folder;
    double duration = 0.0;  ///< seconds between the first and the last arrival
    RecordingCounts written;
    SensorCounts counts;
    LiveStatus devices;
    std::string failure;  ///< of the disk; empty when there was none

    std::string text() const;
    nlohmann::ordered_json json() const;
};

/// Live devices on their way into a recording, with what is to be said meanwhile.
class Recorder {
  public:
    /// Throws Error when the folder cannot be made.
    Recorder(const std::filesystem::path& folder, const RobotConfig& robot, bool quiet);

    /// Until a signal, the end of the devices, the disk's failure or so many seconds (0 = no
    /// limit).
    RecordingSummary run(double most_seconds);

  private:
    void record(double most_seconds);
    void take(const SensorEvent& event);
    void look();
    std::string status_text() const;

    std::filesystem::path folder_;
    RecordingWriter writer_;
    LiveSensors sensors_;
    LidarReader reader_;
    StatusLine line_;
    DeviceNews news_;
    Stopwatch clock_;
    double next_look_ = 0.0;
    RateMeter scan_rate_;
    RateMeter image_rate_;
};

}  // namespace hybrid_slam::tools
