// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "hybrid_slam/recording/record_file.hpp"

namespace hybrid_slam {

/// Of the records in a file, or of those that are on the disk already.
struct RecordCounts {
    std::uint64_t records = 0;
    std::uint64_t bytes = 0;
    double first_arrival = 0.0;  ///< seconds; both 0 while there is none
    double last_arrival = 0.0;
};

struct RecordQueueOptions {
    /// Drops what the disk is too slow for or refuses. Otherwise push waits for a slow disk, and
    /// what the disk refuses is a failure.
    bool may_drop = false;
    double sync_period = 0.0;  ///< seconds; 0 = at the end only
    /// Waiting, or written but not on the disk (that only when it is synced periodically).
    std::size_t most_bytes = 0;
    /// Before a record of so many bytes is written, and before a sync. What they throw counts as a
    /// refusal of the disk.
    std::function<void(std::size_t)> before_write = [](std::size_t) {};
    std::function<void()> before_sync = [] {};
};

struct RecordQueueStatus {
    RecordCounts written;
    RecordCounts synced;
    std::uint64_t dropped = 0;
    std::uint64_t dropped_by_slowness = 0;  ///< of these
    std::string trouble;  ///< why a record was dropped; empty when all since were written
};

/// A record file with the queue of what waits for it and the thread that writes and syncs it.
class RecordQueue {
  public:
    /// Without a `writer` the file is made for the first record.
    RecordQueue(std::filesystem::path file, RecordQueueOptions options,
                std::optional<RecordFileWriter> writer = std::nullopt);
    ~RecordQueue() { close(); }
    RecordQueue(const RecordQueue&) = delete;
    RecordQueue& operator=(const RecordQueue&) = delete;

    /// Throws Error after a failure, and when the file is closed.
    void push(Record record);
    /// Writes and syncs what waits.
    void close();
    /// What the disk refused although it must not be dropped; empty while all is well.
    std::string failure() const;
    RecordQueueStatus status() const;

  private:
    using Clock = std::chrono::steady_clock;
    using Lock = std::unique_lock<std::mutex>;

    bool has_room_for(const Record& record) const;
    void drop(std::size_t count, const std::string& why);

    void run();
    bool wait_for_work(Lock& lock);
    bool sync_is_due() const;
    void write_first(Lock& lock);
    void append(const Record& record);
    void sync(Lock& lock);
    void stop(const std::string& why);

    const std::filesystem::path file_;
    const RecordQueueOptions options_;
    std::optional<RecordFileWriter> writer_;  // of the thread

    mutable std::mutex mutex_;  // guards all below
    std::condition_variable news_;
    std::condition_variable room_;
    std::deque<Record> waiting_;  // the first of them perhaps being written
    std::size_t waiting_bytes_ = 0;
    RecordQueueStatus status_;
    bool dirty_ = false;  // something is not on the disk yet
    Clock::time_point next_sync_ = Clock::now();
    std::string stopped_;  // why nothing is written any more; empty while it is
    bool closing_ = false;

    std::thread thread_;  // the last one: it uses all others
};

}  // namespace hybrid_slam
