// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <limits>
#include <system_error>
#include <utility>

#include "disk.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/recording/recording.hpp"
#include "manifest.hpp"
#include "record_queue.hpp"
#include "recording_folder.hpp"

namespace hybrid_slam {

namespace {

namespace fs = std::filesystem;

/// Of the lidar, waiting for the disk: more than ten minutes of an S300.
constexpr std::size_t kMostLidarWaiting = std::size_t{1} << 26U;

double free_space_of(const fs::path& folder) {
    std::error_code error;
    const fs::space_info space = fs::space(folder, error);
    return error ? std::numeric_limits<double>::infinity() : static_cast<double>(space.available);
}

/// "drive/" and "drive" are the same folder, but only one of them has a parent.
fs::path without_slash(const fs::path& folder) {
    return folder.has_filename() ? folder : folder.parent_path();
}

bool is_simulated(const RecordingOptions& options) {
    return options.origin == "simulated";
}

RecordingManifest manifest_of(const RecordingOptions& options) {
    RecordingManifest manifest;
    manifest.version = kRecordingVersion;
    manifest.origin = options.origin;
    manifest.created = is_simulated(options) ? "" : utc_now();
    return manifest;
}

RecordQueueOptions options_for(const fs::path& file, const RecordingOptions& options) {
    RecordQueueOptions queue;
    queue.sync_period = options.sync_every.value_or(is_simulated(options) ? 0.0 : 1.0);
    queue.most_bytes = kMostLidarWaiting;
    if (options.before_sync) {
        queue.before_sync = [file, call = options.before_sync] { call(file); };
    }
    return queue;
}

RecordQueueOptions options_for_images(const fs::path& file, const RecordingOptions& options) {
    RecordQueueOptions queue = options_for(file, options);
    queue.most_bytes = options.queue_bytes;
    queue.may_drop = !is_simulated(options);
    if (queue.may_drop) {
        const auto free_space = options.free_space ? options.free_space : free_space_of;
        queue.before_write = [folder = file.parent_path(), keep_free = options.keep_free,
                              free_space](std::size_t bytes) {
            if (free_space(folder) < keep_free + static_cast<double>(bytes)) {
                throw Error(folder.string() +
                            ": the disk is nearly full; what is free is kept for the lidar");
            }
        };
    }
    return queue;
}

RecordingCounts together(const RecordCounts& lidar, const RecordCounts& camera) {
    RecordingCounts counts;
    counts.lidar_chunks = lidar.records;
    counts.lidar_bytes = lidar.bytes;
    counts.images = camera.records;
    counts.image_bytes = camera.bytes;
    const RecordCounts& any = lidar.records > 0 ? lidar : camera;
    const RecordCounts& other = camera.records > 0 ? camera : any;
    counts.first_arrival = std::min(any.first_arrival, other.first_arrival);
    counts.last_arrival = std::max(any.last_arrival, other.last_arrival);
    return counts;
}

}  // namespace

struct RecordingWriter::State {
    State(const fs::path& folder_in, const RobotConfig& robot, const RecordingOptions& options)
        : folder(without_slash(folder_in)),
          manifest(manifest_of(options)),
          lidar(folder / RecordingFiles::kLidar,
                options_for(folder / RecordingFiles::kLidar, options),
                make_recording_folder(folder, robot, manifest)),
          camera(folder / RecordingFiles::kCamera,
                 options_for_images(folder / RecordingFiles::kCamera, options)) {}

    void push(LidarBytes chunk) { lidar.push({chunk.arrival, std::move(chunk.bytes)}); }
    void push(CameraFrame frame) { camera.push({frame.arrival, std::move(frame.image)}); }
    void expect_no_failure() const;
    RecordingCounts counts() const;

    const fs::path folder;
    RecordingManifest manifest;
    RecordQueue lidar;  // each with a thread: neither waits while the disk is busy with the other
    RecordQueue camera;
    std::atomic<bool> closed{false};
};

void RecordingWriter::State::expect_no_failure() const {
    for (const std::string& failure : {lidar.failure(), camera.failure()}) {
        if (!failure.empty()) {
            throw Error(failure);
        }
    }
}

RecordingCounts RecordingWriter::State::counts() const {
    const RecordQueueStatus images = camera.status();
    RecordingCounts counts = together(lidar.status().written, images.written);
    counts.dropped_images = images.dropped;
    counts.dropped_by_slowness = images.dropped_by_slowness;
    return counts;
}

RecordingWriter::RecordingWriter(const fs::path& folder, const RobotConfig& robot,
                                 const RecordingOptions& options)
    : state_(std::make_unique<State>(folder, robot, options)) {}

RecordingWriter::~RecordingWriter() {
    try {
        close();
    } catch (const std::exception&) {  // NOLINT(bugprone-empty-catch): what is written stays
    }
}

void RecordingWriter::push(const SensorEvent& event) {
    state_->expect_no_failure();
    std::visit([this](auto what) { state_->push(std::move(what)); }, event);
}

RecordingCounts RecordingWriter::counts() const {
    return state_->counts();
}

RecordingCounts RecordingWriter::synced_counts() const {
    return together(state_->lidar.status().synced, state_->camera.status().synced);
}

std::string RecordingWriter::image_trouble() const {
    return state_->camera.status().trouble;
}

void RecordingWriter::close(const std::optional<RecordingDevices>& devices) {
    State& state = *state_;
    if (state.closed.exchange(true)) {
        return;
    }
    state.lidar.close();
    state.camera.close();
    state.expect_no_failure();
    state.manifest.closed = true;
    state.manifest.counts = state.counts();
    state.manifest.devices = devices;
    disk::replace_file(state.folder / RecordingFiles::kManifest, to_text(state.manifest));
}

}  // namespace hybrid_slam
