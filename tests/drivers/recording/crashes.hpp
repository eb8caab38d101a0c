// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <random>
#include <stdexcept>
#include <thread>

#include "recording_support.hpp"

/// What becomes of recordings when the recorder is killed or their files lose their ends. Used by
/// the tests and by the benchmark.
namespace hybrid_slam::test {

/// What a recorder has on the disk for certain.
struct SyncReport {
    std::uint64_t chunks = 0;
    std::uint64_t images = 0;
};

/// Records events as fast as a busy line brings them, and reports each sync. Never returns.
[[noreturn]] inline void record_until_killed(const std::filesystem::path& folder,
                                             const RecordingOptions& options, int report_to) {
    RecordingWriter writer(folder, RobotConfig(), options);
    SyncReport reported;
    for (std::uint64_t i = 0; i < 100'000; ++i) {  // so that a forgotten one ends
        if (i % 4 == 0) {
            writer.push(image_event(i / 4));
        }
        writer.push(lidar_event(i));
        const RecordingCounts synced = writer.synced_counts();
        if (i == 0 || synced.lidar_chunks != reported.chunks || synced.images != reported.images) {
            reported = {synced.lidar_chunks, synced.images};
            if (::write(report_to, &reported, sizeof reported) != sizeof reported) {
                break;
            }
        }
        std::this_thread::sleep_for(std::chrono::microseconds(300));
    }
    ::_exit(0);
}

/// Starts such a recorder, kills it so long after its first event, and returns its last report.
inline SyncReport record_and_kill(const std::filesystem::path& folder,
                                  const RecordingOptions& options,
                                  std::chrono::microseconds after) {
    int ends[2] = {};
    if (::pipe(ends) != 0) {
        throw std::runtime_error("no pipe");
    }
    const pid_t child = ::fork();
    if (child == 0) {
        ::close(ends[0]);
        record_until_killed(folder, options, ends[1]);
    }
    ::close(ends[1]);
    SyncReport report;
    const auto next = [&] {
        SyncReport fresh;
        const bool whole = ::read(ends[0], &fresh, sizeof fresh) == sizeof fresh;
        report = whole ? fresh : report;
        return whole;
    };
    next();
    std::this_thread::sleep_for(after);
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    while (next()) {
    }
    ::close(ends[0]);
    return report;
}

struct KillOutcome {
    int kills = 0;
    int opened = 0;
    std::uint64_t synced = 0;   ///< events that were reported as synced
    std::uint64_t read = 0;     ///< events that came back
    std::uint64_t missing = 0;  ///< synced, but did not come back
    std::uint64_t wrong = 0;    ///< came back as something else
};

/// Counts what of events 0, 1, 2, ... came back.
inline void judge(const std::filesystem::path& folder, const SyncReport& synced,
                  KillOutcome& outcome) {
    RecordingReader reader(folder);
    ++outcome.opened;
    SyncReport read;
    while (const std::optional<SensorEvent> event = reader.next()) {
        const bool is_chunk = std::holds_alternative<LidarBytes>(*event);
        const SensorEvent expected = is_chunk ? SensorEvent(lidar_event(read.chunks++))
                                              : SensorEvent(image_event(read.images++));
        outcome.wrong += same(*event, expected) ? 0 : 1;
    }
    outcome.synced += synced.chunks + synced.images;
    outcome.read += read.chunks + read.images;
    outcome.missing += synced.chunks - std::min(synced.chunks, read.chunks);
    outcome.missing += synced.images - std::min(synced.images, read.images);
}

/// Half of them sync as they always do, within two seconds; the others more often.
inline KillOutcome kill_recorders(const std::filesystem::path& folder, int kills) {
    KillOutcome outcome;
    std::mt19937 rng(1);
    for (; outcome.kills < kills; ++outcome.kills) {
        const std::filesystem::path place = folder / ("killed" + std::to_string(outcome.kills));
        RecordingOptions options;
        const bool often = outcome.kills % 2 == 0;
        if (often) {
            options.sync_every = 0.02;
        }
        const std::chrono::microseconds after(rng() % (often ? 200'000 : 2'000'000));
        const SyncReport synced = record_and_kill(place, options, after);
        try {
            judge(place, synced, outcome);
        } catch (const std::exception&) {
            outcome.missing += synced.chunks + synced.images;
        }
        std::filesystem::remove_all(place);
    }
    return outcome;
}

/// A finished recording of a drive.
inline void record_drive(const std::filesystem::path& folder, std::uint64_t chunks,
                         std::uint64_t images, std::size_t image_bytes = 30'000) {
    RecordingOptions options;
    options.origin = "simulated";
    RecordingWriter writer(folder, RobotConfig(), options);
    for (std::uint64_t i = 0; i < std::max(chunks, images); ++i) {
        if (i < chunks) {
            writer.push(lidar_event(i));
        }
        if (i < images) {
            writer.push(image_event(i, image_bytes));
        }
    }
    writer.close();
}

/// Where the records of an intact file end, and when they came.
struct RecordIndex {
    explicit RecordIndex(const std::filesystem::path& file) {
        RecordFileReader reader(file);
        size = reader.size();
        while (const std::optional<Record> record = reader.next()) {
            begins.push_back(ends.empty() ? 16 : ends.back());
            ends.push_back(reader.position());
            arrivals.push_back(record->arrival);
        }
    }
    /// How many records lie wholly before this byte.
    std::size_t before(std::uint64_t byte) const {
        return static_cast<std::size_t>(std::upper_bound(ends.begin(), ends.end(), byte) -
                                        ends.begin());
    }

    std::uint64_t size = 0;
    std::vector<std::uint64_t> begins;
    std::vector<std::uint64_t> ends;
    std::vector<double> arrivals;
};

struct CutOutcome {
    std::uint64_t tried = 0;
    std::uint64_t opened = 0;
    std::uint64_t lost = 0;   ///< records wholly before the cut that did not come back
    std::uint64_t wrong = 0;  ///< records that came back otherwise than written
};

/// Reads the file, which is whole before `cut` alone, from the record before the cut on: what is
/// further ahead the cut cannot change.
inline void judge_tail(const std::filesystem::path& file, const RecordIndex& whole,
                       std::uint64_t cut, CutOutcome& outcome) {
    ++outcome.tried;
    try {
        RecordFileReader reader(file);
        ++outcome.opened;
        const std::size_t expected = whole.before(cut);
        std::size_t number = expected > 0 ? expected - 1 : 0;
        if (expected > 0) {
            reader.seek(whole.begins[number]);
        }
        while (const std::optional<Record> record = reader.next()) {
            const bool right = number < whole.ends.size() &&
                               reader.position() == whole.ends[number] &&
                               record->arrival == whole.arrivals[number];
            outcome.wrong += right ? 0 : 1;
            ++number;
        }
        outcome.lost += expected - std::min(expected, number);
    } catch (const std::exception&) {
        outcome.lost += whole.before(cut);
    }
}

/// Cuts the file one byte shorter each time, down to `bytes` less than it was.
inline CutOutcome cut_byte_by_byte(const std::filesystem::path& file, std::uint64_t bytes) {
    const RecordIndex whole(file);
    CutOutcome outcome;
    const std::uint64_t least = whole.size - std::min(bytes, whole.size);
    for (std::uint64_t size = whole.size; size-- > least;) {
        std::filesystem::resize_file(file, size);
        judge_tail(file, whole, size, outcome);
    }
    return outcome;
}

/// Zeroes the end of the file, `step` bytes more each time, up to `bytes`.
inline CutOutcome zero_the_tail(const std::filesystem::path& file, std::uint64_t bytes,
                                std::uint64_t step) {
    const RecordIndex whole(file);
    CutOutcome outcome;
    const int descriptor = ::open(file.c_str(), O_WRONLY | O_CLOEXEC);
    const Bytes zeros(step);
    for (std::uint64_t zeroed = step; zeroed <= std::min(bytes, whole.size); zeroed += step) {
        const std::uint64_t from = whole.size - zeroed;
        if (::pwrite(descriptor, zeros.data(), step, static_cast<off_t>(from)) !=
            static_cast<ssize_t>(step)) {
            break;
        }
        judge_tail(file, whole, from, outcome);
    }
    ::close(descriptor);
    return outcome;
}

}  // namespace hybrid_slam::test
