// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <limits>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include "disk.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/recording/recording.hpp"
#include "manifest.hpp"
#include "recording_folder.hpp"

namespace hybrid_slam {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using Lock = std::unique_lock<std::mutex>;

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

RecordingManifest manifest_of(const RecordingOptions& options) {
    RecordingManifest manifest;
    manifest.version = kRecordingVersion;
    manifest.origin = options.origin;
    manifest.created = options.origin == "simulated" ? "" : utc_now();
    return manifest;
}

void count_arrival(RecordingCounts& counts, double arrival) {
    const bool first = counts.lidar_chunks + counts.images == 0;
    counts.first_arrival = first ? arrival : std::min(counts.first_arrival, arrival);
    counts.last_arrival = first ? arrival : std::max(counts.last_arrival, arrival);
}

}  // namespace

struct RecordingWriter::State {
    State(const fs::path& folder_in, const RobotConfig& robot, RecordingOptions options_in)
        : folder(without_slash(folder_in)),
          options(std::move(options_in)),
          lossless(options.origin == "simulated"),
          sync_period(options.sync_every.value_or(lossless ? 0.0 : 1.0)),
          manifest(manifest_of(options)),
          lidar(make_recording_folder(folder, robot, manifest)),
          thread([this] { run(); }) {}

    void push(LidarBytes chunk);
    void push(CameraFrame frame);
    void expect_open() const;
    bool has_room_for(const CameraFrame& frame) const;

    void run();
    void work(Lock& lock);
    bool sync_is_due() const { return sync_period > 0.0 && dirty && Clock::now() >= next_sync; }
    bool wait_for_work(Lock& lock);
    void sync(Lock& lock);
    void save_what_is_written(Lock& lock);
    void write_chunk(Lock& lock);
    void write_image(Lock& lock);
    std::string try_image(const CameraFrame& frame);

    const fs::path folder;
    const RecordingOptions options;
    const bool lossless;       // of a simulation: waits rather than drops
    const double sync_period;  // seconds; 0 = at the end only
    RecordingManifest manifest;
    RecordFileWriter lidar;                  // of the writing thread
    std::optional<RecordFileWriter> camera;  // likewise; made for the first image

    mutable std::mutex mutex;  // guards all below
    std::condition_variable news;
    std::condition_variable room;
    std::deque<LidarBytes> chunks;
    std::deque<CameraFrame> frames;
    std::size_t chunk_bytes = 0;  // waiting, or just being written
    std::size_t frame_bytes = 0;
    RecordingCounts counts;
    RecordingCounts synced;
    bool dirty = false;  // something is not on the disk yet
    Clock::time_point next_sync = Clock::now();
    std::string failure;
    std::string image_trouble;
    bool closing = false;

    std::thread thread;  // the last one: it uses all others
};

void RecordingWriter::State::expect_open() const {
    if (!failure.empty()) {
        throw Error(failure);
    }
    if (closing) {
        throw Error(folder.string() + ": the recording is closed");
    }
}

void RecordingWriter::State::push(LidarBytes chunk) {
    Lock lock(mutex);
    room.wait(lock, [&] { return chunk_bytes <= kMostLidarWaiting || !failure.empty(); });
    expect_open();
    chunk_bytes += chunk.bytes.size();
    chunks.push_back(std::move(chunk));
    news.notify_one();
}

/// A single image always has room, however large it is.
bool RecordingWriter::State::has_room_for(const CameraFrame& frame) const {
    return frames.empty() || frame_bytes + frame.image.size() <= options.queue_bytes;
}

void RecordingWriter::State::push(CameraFrame frame) {
    Lock lock(mutex);
    if (lossless) {
        room.wait(lock, [&] { return has_room_for(frame) || !failure.empty(); });
    }
    expect_open();
    if (!has_room_for(frame)) {
        ++counts.dropped_images;
        ++counts.dropped_by_slowness;
        return;
    }
    frame_bytes += frame.image.size();
    frames.push_back(std::move(frame));
    news.notify_one();
}

void RecordingWriter::State::run() {
    Lock lock(mutex);
    try {
        work(lock);
    } catch (const std::exception& error) {
        if (!lock.owns_lock()) {
            lock.lock();
        }
        failure = error.what();
        room.notify_all();
        save_what_is_written(lock);
    }
}

/// After a failure: a full disk can still sync what it took before.
void RecordingWriter::State::save_what_is_written(Lock& lock) {
    try {
        sync(lock);
    } catch (const std::exception&) {  // NOLINT(bugprone-empty-catch): the first failure is told
    }
}

/// Until all is written and the recording is to be closed.
void RecordingWriter::State::work(Lock& lock) {
    while (wait_for_work(lock)) {
        if (sync_is_due()) {
            sync(lock);
        } else if (!chunks.empty()) {
            write_chunk(lock);
        } else if (!frames.empty()) {
            write_image(lock);
        }
    }
    sync(lock);
}

/// False when nothing is left to do.
bool RecordingWriter::State::wait_for_work(Lock& lock) {
    const auto has_work = [this] { return closing || !chunks.empty() || !frames.empty(); };
    if (sync_period > 0.0 && dirty) {
        news.wait_until(lock, next_sync, has_work);
    } else {
        news.wait(lock, has_work);
    }
    return !closing || !chunks.empty() || !frames.empty();
}

void RecordingWriter::State::sync(Lock& lock) {
    const RecordingCounts written = counts;
    dirty = false;
    // From start to start, so that no record waits longer than that for its turn.
    next_sync = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                   std::chrono::duration<double>(sync_period));
    lock.unlock();
    lidar.sync();
    std::string trouble;
    try {
        if (camera) {
            camera->sync();
        }
    } catch (const Error& error) {
        if (lossless) {
            throw;
        }
        trouble = error.what();
    }
    lock.lock();
    if (trouble.empty()) {
        synced = written;
    } else {
        image_trouble = trouble;
    }
}

void RecordingWriter::State::write_chunk(Lock& lock) {
    const LidarBytes chunk = std::move(chunks.front());
    chunks.pop_front();
    lock.unlock();
    lidar.append(chunk.arrival, chunk.bytes.data(), chunk.bytes.size());
    lock.lock();
    count_arrival(counts, chunk.arrival);
    ++counts.lidar_chunks;
    counts.lidar_bytes += chunk.bytes.size();
    chunk_bytes -= chunk.bytes.size();
    dirty = true;
    room.notify_all();
}

void RecordingWriter::State::write_image(Lock& lock) {
    const CameraFrame& frame = frames.front();  // stays in the queue: it has not made room yet
    lock.unlock();
    const std::string trouble = try_image(frame);
    lock.lock();
    if (trouble.empty()) {
        count_arrival(counts, frame.arrival);
        ++counts.images;
        counts.image_bytes += frame.image.size();
        dirty = true;
    } else {
        ++counts.dropped_images;
        image_trouble = trouble;
    }
    frame_bytes -= frame.image.size();
    frames.pop_front();
    room.notify_all();
}

/// Why the image could not be written; empty when it was.
std::string RecordingWriter::State::try_image(const CameraFrame& frame) {
    const auto free_space = options.free_space ? options.free_space : free_space_of;
    if (!lossless &&
        free_space(folder) < options.keep_free + static_cast<double>(frame.image.size())) {
        return folder.string() + ": the disk is nearly full; what is free is kept for the lidar";
    }
    try {
        if (!camera) {
            camera.emplace(folder / RecordingFiles::kCamera);
        }
        camera->append(frame.arrival, frame.image.data(), frame.image.size());
    } catch (const Error& error) {
        if (lossless) {
            throw;
        }
        return error.what();
    }
    return {};
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
    std::visit([this](auto what) { state_->push(std::move(what)); }, event);
}

RecordingCounts RecordingWriter::counts() const {
    const Lock lock(state_->mutex);
    return state_->counts;
}

RecordingCounts RecordingWriter::synced_counts() const {
    const Lock lock(state_->mutex);
    return state_->synced;
}

std::string RecordingWriter::image_trouble() const {
    const Lock lock(state_->mutex);
    return state_->image_trouble;
}

void RecordingWriter::close() {
    State& state = *state_;
    {
        const Lock lock(state.mutex);
        if (state.closing) {
            return;
        }
        state.closing = true;
    }
    state.news.notify_one();
    state.thread.join();
    if (!state.failure.empty()) {
        throw Error(state.failure);
    }
    state.manifest.closed = true;
    state.manifest.counts = state.counts;
    disk::replace_file(state.folder / RecordingFiles::kManifest, to_text(state.manifest));
}

}  // namespace hybrid_slam
