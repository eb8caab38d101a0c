// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
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
    std::uint64_t dropped_images = 0;       ///< because the disk was slow, nearly full or refused
    std::uint64_t dropped_by_slowness = 0;  ///< of these: more waited than the queue takes
    double first_arrival = 0.0;             ///< seconds; both 0 while nothing has come
    double last_arrival = 0.0;
};

/// How the devices did before their events came to the writer.
struct RecordingDevices {
    std::uint64_t lidar_connects = 0;  ///< how often it could be opened
    std::uint64_t lidar_dropped = 0;   ///< pieces of its bytes that the program was too slow for
    std::uint64_t camera_connects = 0;
    std::uint64_t camera_dropped = 0;  ///< images, likewise
};

struct RecordingOptions {
    /// For the manifest: live or simulated. Of a simulation no image is dropped (push waits for the
    /// disk instead, and a full disk is an error) and nothing depends on a clock: the same events
    /// give the same bytes.
    std::string origin = "live";
    /// Seconds of the wall clock; 0 = at the end only. When left out: 1 s live, else at the end.
    std::optional<double> sync_every;
    double keep_free = 256e6;              ///< bytes of the disk that images may not take
    std::size_t queue_bytes = 64u << 20u;  ///< images that are not on a slow disk yet, at most
    /// Bytes that are free where the folder lies, asked before each image; tests put fakes here.
    std::function<double(const std::filesystem::path&)> free_space;
    /// Called with the file before each sync of it; tests put slow and failing disks here.
    std::function<void(const std::filesystem::path&)> before_sync;
};

/// Writes a recording as it comes. Each file has a thread of its own that writes and syncs it every
/// second, so that a power cut loses at most that, and of the lidar no more while the disk is slow
/// with images. These are dropped before scans when the disk is slow or nearly full, or fails.
class RecordingWriter {
  public:
    /// Makes the folder with manifest, robot.yaml and an empty lidar.rec. Throws Error when it
    /// exists and is not empty, or cannot be made.
    RecordingWriter(const std::filesystem::path& folder, const RobotConfig& robot,
                    const RecordingOptions& options = {});
    ~RecordingWriter();  ///< closes as well as it can

    /// Throws Error, from then on each time, when the lidar's bytes cannot be written any more;
    /// what was recorded before stays. Waits for the disk only while 64 MB of the lidar, or
    /// queue_bytes of a simulation's images, wait for it.
    void push(const SensorEvent& event);
    RecordingCounts counts() const;         ///< with the system; a killed program loses none of it
    RecordingCounts synced_counts() const;  ///< on the disk; a power cut loses none of it
    /// Why images are dropped; empty when none was, and when all since were written.
    std::string image_trouble() const;
    /// Writes what waits, and the manifest with the counts. Throws Error.
    void close(const std::optional<RecordingDevices>& devices = std::nullopt);

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
    std::optional<RecordingDevices> devices;  ///< only of live recordings
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
    /// Of both files, at their ends: what a crash left unfinished. Known when next was empty.
    std::uint64_t torn_bytes() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
