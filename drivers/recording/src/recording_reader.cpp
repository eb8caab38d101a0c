// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/recording/recording.hpp"
#include "manifest.hpp"

namespace hybrid_slam {

namespace {

namespace fs = std::filesystem;

/// One of the files, and its next record.
struct Track {
    explicit Track(const fs::path& file) : reader(file), next(reader.next()) {}

    Record take() { return *std::exchange(next, reader.next()); }

    RecordFileReader reader;
    std::optional<Record> next;
};

fs::path existing(const fs::path& folder) {
    std::error_code ignored;
    if (!fs::is_directory(folder, ignored)) {
        throw Error(folder.string() + ": there is no such folder");
    }
    return folder;
}

std::optional<Track> camera_track(const fs::path& folder, bool images) {
    std::error_code ignored;
    const fs::path file = folder / RecordingFiles::kCamera;
    return images && fs::exists(file, ignored) ? std::make_optional<Track>(file) : std::nullopt;
}

}  // namespace

struct RecordingReader::State {
    State(const fs::path& folder, bool images)
        : manifest(read_manifest(existing(folder))),
          robot(read_robot(folder / RecordingFiles::kRobot)),
          lidar(folder / RecordingFiles::kLidar),
          camera(camera_track(folder, images)) {}

    template <typename Count>
    auto of_both(Count count) const {
        return count(lidar.reader) + (camera ? count(camera->reader) : 0);
    }

    RecordingManifest manifest;
    RobotConfig robot;
    Track lidar;
    std::optional<Track> camera;
};

RecordingReader::RecordingReader(const fs::path& folder, bool images)
    : state_(std::make_unique<State>(folder, images)) {}
RecordingReader::~RecordingReader() = default;

std::optional<SensorEvent> RecordingReader::next() {
    Track& lidar = state_->lidar;
    std::optional<Track>& camera = state_->camera;
    const bool has_image = camera && camera->next;
    if (lidar.next && !(has_image && camera->next->arrival < lidar.next->arrival)) {
        Record record = lidar.take();
        return LidarBytes{record.arrival, std::move(record.bytes)};
    }
    if (has_image) {
        Record record = camera->take();
        return CameraFrame{record.arrival, std::move(record.bytes)};
    }
    return std::nullopt;
}

double RecordingReader::progress() const {
    const auto size = state_->of_both([](const RecordFileReader& reader) { return reader.size(); });
    const auto done =
        state_->of_both([](const RecordFileReader& reader) { return reader.position(); });
    const bool ended = !state_->lidar.next && !(state_->camera && state_->camera->next);
    return ended ? 1.0 : static_cast<double>(done) / static_cast<double>(size);
}

const RobotConfig& RecordingReader::robot() const {
    return state_->robot;
}

const RecordingManifest& RecordingReader::manifest() const {
    return state_->manifest;
}

std::uint64_t RecordingReader::damaged_bytes() const {
    return state_->of_both([](const RecordFileReader& reader) { return reader.damaged_bytes(); });
}

std::uint64_t RecordingReader::torn_bytes() const {
    return state_->of_both([](const RecordFileReader& reader) { return reader.torn_bytes(); });
}

}  // namespace hybrid_slam
