// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "hybrid_slam/recording/record_file.hpp"
#include "hybrid_slam/sensors/robot.hpp"
#include "hybrid_slam/sensors/sensor_event.hpp"

namespace hybrid_slam {

/// Names of the files in the folder of a recording.
struct RecordingFiles {
    static constexpr auto kManifest = "manifest.json";
    static constexpr auto kRobot = "robot.yaml";
    static constexpr auto kLidar = "lidar.rec";    ///< the lidar's bytes as they came
    static constexpr auto kCamera = "camera.rec";  ///< the images as they came
    static constexpr auto kTruth = "truth.tum";    ///< of a simulated drive: the robot at each scan
};

/// What was written, and what had to be left out.
struct RecordingCounts {
    std::uint64_t lidar_chunks = 0;
    std::uint64_t lidar_bytes = 0;
    std::uint64_t images = 0;
    std::uint64_t image_bytes = 0;
    std::uint64_t dropped_images = 0;  ///< because the disk was slow or nearly full
    double first_arrival = 0.0;        ///< seconds; both 0 while nothing has come
    double last_arrival = 0.0;
};

struct RecordingOptions {
    std::string origin = "live";           ///< for the manifest: live, simulated
    double sync_every = 1.0;               ///< seconds of arrival times; 0 = at the end only
    double keep_free = 256e6;              ///< bytes of the disk that images may not take
    std::size_t queue_bytes = 64u << 20u;  ///< images waiting for a slow disk, at most
};

/// Writes a recording as it comes. A writing thread syncs every second, so that a power cut loses
/// at most that; images are dropped before scans when the disk is slow or nearly full.
class RecordingWriter {
  public:
    /// Makes the folder with manifest and robot.yaml. Throws Error when it exists and is not empty,
    /// or cannot be made.
    RecordingWriter(const std::filesystem::path& folder, const RobotConfig& robot,
                    const RecordingOptions& options = {});
    ~RecordingWriter();  ///< closes as well as it can

    /// Throws Error when the lidar's bytes cannot be written any more.
    void push(const SensorEvent& event);
    RecordingCounts counts() const;
    /// Writes what waits, and the manifest with its counts. Throws Error.
    void close();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// What the manifest says. A recording that was not closed has no counts there.
struct RecordingManifest {
    int version = 1;
    std::string origin;
    std::string created;  ///< UTC, ISO 8601; empty for simulated recordings
    bool closed = false;
    std::optional<RecordingCounts> counts;
};

/// Whether the folder looks like a recording.
bool is_recording(const std::filesystem::path& folder);

/// Plays a recording back in the order of arrival. Opens whatever a crash left: a missing image
/// file, torn ends, a manifest that was never closed.
class RecordingReader : public SensorStream {
  public:
    /// With `images` false the image file is not touched. Throws Error that names the file.
    explicit RecordingReader(const std::filesystem::path& folder, bool images = true);
    ~RecordingReader() override;

    std::optional<SensorEvent> next() override;
    double progress() const override;

    const RobotConfig& robot() const;
    const RecordingManifest& manifest() const;
    std::uint64_t damaged_bytes() const;  ///< so far, of both files

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
