// SPDX-License-Identifier: Apache-2.0
#include "record_queue.hpp"

#include <algorithm>
#include <utility>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {

namespace {

void count(const Record& record, RecordCounts& counts) {
    const bool first = counts.records == 0;
    const double arrival = record.arrival;
    counts.first_arrival = first ? arrival : std::min(counts.first_arrival, arrival);
    counts.last_arrival = first ? arrival : std::max(counts.last_arrival, arrival);
    ++counts.records;
    counts.bytes += record.bytes.size();
}

/// Does what takes long while others may have the lock. Why it failed; empty when it did not.
template <typename Work>
std::string unlocked(std::unique_lock<std::mutex>& lock, Work work) {
    std::string trouble;
    lock.unlock();
    try {
        work();
    } catch (const std::exception& error) {
        trouble = error.what();
    }
    lock.lock();
    return trouble;
}

}  // namespace

RecordQueue::RecordQueue(std::filesystem::path file, RecordQueueOptions options,
                         std::optional<RecordFileWriter> writer)
    : file_(std::move(file)),
      options_(std::move(options)),
      writer_(std::move(writer)),
      thread_([this] { run(); }) {}

void RecordQueue::push(Record record) {
    Lock lock(mutex_);
    if (!options_.may_drop) {
        room_.wait(lock, [&] { return has_room_for(record) || !stopped_.empty(); });
    }
    if (!options_.may_drop && !stopped_.empty()) {
        throw Error(stopped_);
    }
    if (closing_) {
        throw Error(file_.string() + ": the recording is closed");
    }
    if (!stopped_.empty()) {
        drop(1, stopped_);
    } else if (!has_room_for(record)) {
        drop(1, "the disk is too slow for them");
        ++status_.dropped_by_slowness;
    } else {
        waiting_bytes_ += record.bytes.size();
        waiting_.push_back(std::move(record));
        news_.notify_one();
    }
}

/// What the system has taken is no better than what waits for it, as long as the disk has not. One
/// record alone always has room, however large it is.
bool RecordQueue::has_room_for(const Record& record) const {
    const std::uint64_t unsynced = status_.written.bytes - status_.synced.bytes;
    const std::uint64_t held = waiting_bytes_ + (options_.sync_period > 0.0 ? unsynced : 0);
    return held == 0 || held + record.bytes.size() <= options_.most_bytes;
}

void RecordQueue::drop(std::size_t count, const std::string& why) {
    status_.dropped += count;
    status_.trouble = why;
}

/// Until all is written and the file is to be closed.
void RecordQueue::run() {
    Lock lock(mutex_);
    while (wait_for_work(lock)) {
        if (sync_is_due()) {
            sync(lock);
        } else if (!waiting_.empty()) {
            write_first(lock);
        }
    }
    sync(lock);
}

/// False when nothing is left to do.
bool RecordQueue::wait_for_work(Lock& lock) {
    const auto has_work = [this] { return closing_ || !waiting_.empty(); };
    if (options_.sync_period > 0.0 && dirty_) {
        news_.wait_until(lock, next_sync_, has_work);
    } else {
        news_.wait(lock, has_work);
    }
    return !closing_ || !waiting_.empty();
}

bool RecordQueue::sync_is_due() const {
    return options_.sync_period > 0.0 && dirty_ && Clock::now() >= next_sync_;
}

void RecordQueue::write_first(Lock& lock) {
    const Record& record = waiting_.front();  // stays in the queue: it has not made room yet
    const std::string trouble = unlocked(lock, [&] { append(record); });
    if (trouble.empty()) {
        count(record, status_.written);
        dirty_ = true;
    } else if (options_.may_drop) {
        drop(1, trouble);
    } else {
        stop(trouble);
        sync(lock);  // a full disk can still sync what it took before
        return;
    }
    waiting_bytes_ -= record.bytes.size();
    waiting_.pop_front();
    if (trouble.empty() && waiting_.empty()) {
        status_.trouble.clear();
    }
    room_.notify_all();
}

void RecordQueue::append(const Record& record) {
    options_.before_write(record.bytes.size());
    if (!writer_) {
        writer_.emplace(file_);
    }
    writer_->append(record.arrival, record.bytes.data(), record.bytes.size());
}

void RecordQueue::sync(Lock& lock) {
    if (!dirty_) {
        return;
    }
    dirty_ = false;
    // From start to start, so that no record waits longer than that for its turn.
    next_sync_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                    std::chrono::duration<double>(options_.sync_period));
    const RecordCounts written = status_.written;
    const std::string trouble = unlocked(lock, [this] {
        options_.before_sync();
        writer_->sync();
    });
    if (trouble.empty()) {
        status_.synced = written;
        room_.notify_all();
    } else {
        // The system forgets what it could not write: the next sync would succeed without it.
        stop(trouble + "; its end may be lost, and nothing more goes into it");
    }
}

void RecordQueue::stop(const std::string& why) {
    stopped_ = stopped_.empty() ? why : stopped_;
    drop(waiting_.size(), stopped_);
    waiting_.clear();
    waiting_bytes_ = 0;
    room_.notify_all();
}

void RecordQueue::close() {
    {
        const Lock lock(mutex_);
        closing_ = true;
    }
    news_.notify_one();
    if (thread_.joinable()) {
        thread_.join();
    }
}

std::string RecordQueue::failure() const {
    const Lock lock(mutex_);
    return options_.may_drop ? "" : stopped_;
}

RecordQueueStatus RecordQueue::status() const {
    const Lock lock(mutex_);
    return status_;
}

}  // namespace hybrid_slam
