// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string>

#include "disk.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/recording/record_file.hpp"
#include "record_layout.hpp"

namespace hybrid_slam {

namespace {

namespace layout = record_layout;

constexpr std::uint64_t kReadSize = std::uint64_t{1} << 18U;

/// A part of a file in memory, moved along as it is read.
class Window {
  public:
    explicit Window(const std::filesystem::path& file)
        : file_(file), descriptor_(file, O_RDONLY | O_NONBLOCK) {  // a pipe must not hold us up
        struct stat info {};
        if (::fstat(descriptor_.number(), &info) != 0) {
            throw disk::last_error(file);
        }
        if (!S_ISREG(info.st_mode)) {
            throw Error(file.string() + ": is no plain file");
        }
        size_ = static_cast<std::uint64_t>(info.st_size);
    }

    const std::filesystem::path& file() const { return file_; }
    std::uint64_t size() const { return size_; }

    /// The bytes from `offset` on, at least `count` of them; null when the file has fewer.
    const std::uint8_t* at(std::uint64_t offset, std::uint64_t count) {
        if (offset > size_ || count > size_ - offset) {
            return nullptr;
        }
        if (offset < begin_ || offset + count > begin_ + filled_) {
            load(offset, count);
        }
        return offset + count <= begin_ + filled_ ? buffer_.data() + (offset - begin_) : nullptr;
    }
    /// How many bytes are in memory from `offset` on, after `at` gave some of them.
    std::uint64_t available(std::uint64_t offset) const { return begin_ + filled_ - offset; }

  private:
    void load(std::uint64_t offset, std::uint64_t count);

    std::filesystem::path file_;
    disk::Descriptor descriptor_;
    std::uint64_t size_ = 0;
    std::vector<std::uint8_t> buffer_;
    std::uint64_t begin_ = 0;   // of the buffer in the file
    std::uint64_t filled_ = 0;  // bytes in the buffer
};

void Window::load(std::uint64_t offset, std::uint64_t count) {
    const bool overlaps = offset >= begin_ && offset < begin_ + filled_;
    const std::uint64_t kept = overlaps ? begin_ + filled_ - offset : 0;
    const std::uint64_t wanted = std::min(size_ - offset, std::max(count, kReadSize));
    const auto first =
        buffer_.begin() + static_cast<std::ptrdiff_t>(overlaps ? offset - begin_ : 0);
    std::copy(first, first + static_cast<std::ptrdiff_t>(kept), buffer_.begin());
    if (buffer_.size() < wanted) {
        buffer_.resize(wanted);
    }
    begin_ = offset;
    filled_ = kept;
    while (filled_ < wanted) {
        const ssize_t got = ::pread(descriptor_.number(), buffer_.data() + filled_,
                                    wanted - filled_, static_cast<off_t>(begin_ + filled_));
        if (got < 0 && errno != EINTR) {
            throw disk::last_error(file_);
        }
        if (got == 0) {  // somebody cut the file meanwhile
            size_ = begin_ + filled_;
            return;
        }
        filled_ += got < 0 ? 0 : static_cast<std::uint64_t>(got);
    }
}

}  // namespace

struct RecordFileReader::State {
    explicit State(const std::filesystem::path& file) : window(file) { open(); }

    /// Looks at the header of the file.
    void open();
    /// Moves `at` to the next intact record at or behind it, or to where the file ends without one.
    bool find();

    Window window;
    std::uint64_t at = 0;        // where to look for the next record
    std::uint64_t expected = 0;  // behind the last intact one: what lies between is damaged
    bool sought = false;         // the next record begins where it is found
    std::uint64_t damaged = 0;
    std::uint64_t torn = 0;
    bool ended = false;
    layout::RecordFrame frame;  // of the record found
};

bool RecordFileReader::State::find() {
    while (const std::uint8_t* const bytes = window.at(at, layout::kRecordHeader)) {
        const std::size_t places = window.available(at) - layout::kRecordHeader + 1;
        const void* const mark = std::memchr(bytes, layout::kMark[0], places);
        if (mark == nullptr) {
            at += places;
            continue;
        }
        at += static_cast<std::uint64_t>(static_cast<const std::uint8_t*>(mark) - bytes);
        if (layout::decode(static_cast<const std::uint8_t*>(mark), frame) &&
            frame.length <= RecordFileWriter::kMostBytes) {
            const std::uint8_t* const record = window.at(at, layout::kRecordHeader + frame.length);
            if (record != nullptr &&
                layout::crc_of(record + layout::kRecordHeader, frame.length) == frame.payload_crc) {
                return true;
            }
        }
        ++at;
    }
    return false;
}

void RecordFileReader::State::open() {
    const layout::FileHeader ours = layout::file_header();
    const std::size_t count = std::min<std::uint64_t>(window.size(), ours.size());
    const std::uint8_t* const bytes = window.at(0, count);
    if (count == ours.size() && std::equal(ours.begin(), ours.end(), bytes)) {
        at = expected = count;
        return;
    }
    // Cut, or never written, within these bytes.
    const std::uint8_t* const other = std::mismatch(bytes, bytes + count, ours.begin()).first;
    if (std::all_of(other, bytes + count, [](std::uint8_t byte) { return byte == 0; })) {
        return;
    }
    if (count == ours.size() && std::equal(layout::kMagic.begin(), layout::kMagic.end(), bytes) &&
        layout::get<std::uint32_t>(bytes + 12) == layout::crc_of(bytes, 12)) {
        throw Error(window.file().string() + ": has version " +
                    std::to_string(layout::get<std::uint32_t>(bytes + 8)) +
                    ", but this program reads record files up to version " +
                    std::to_string(layout::kVersion));
    }
    if (!find()) {  // the beginning alone may be damaged
        throw Error(window.file().string() + ": is no record file");
    }
}

RecordFileReader::RecordFileReader(const std::filesystem::path& file)
    : state_(std::make_unique<State>(file)) {}
RecordFileReader::~RecordFileReader() = default;
RecordFileReader::RecordFileReader(RecordFileReader&&) noexcept = default;
RecordFileReader& RecordFileReader::operator=(RecordFileReader&&) noexcept = default;

std::optional<Record> RecordFileReader::next() {
    State& state = *state_;
    if (!state.find()) {
        state.torn = state.window.size() - std::min(state.expected, state.window.size());
        state.ended = true;
        return std::nullopt;
    }
    const std::uint64_t length = layout::kRecordHeader + state.frame.length;
    const std::uint8_t* const bytes = state.window.at(state.at, length);
    Record record;
    record.arrival = layout::seconds_of(state.frame.arrival);
    record.bytes.assign(bytes + layout::kRecordHeader, bytes + length);
    state.damaged += state.sought ? 0 : state.at - state.expected;
    state.sought = false;
    state.at = state.expected = state.at + length;
    return record;
}

void RecordFileReader::seek(std::uint64_t offset) {
    state_->at = state_->expected = offset;
    state_->sought = true;
    state_->ended = false;
}

std::uint64_t RecordFileReader::position() const {
    return state_->expected;
}

std::uint64_t RecordFileReader::size() const {
    return state_->window.size();
}

std::uint64_t RecordFileReader::damaged_bytes() const {
    return state_->damaged;
}

std::uint64_t RecordFileReader::torn_bytes() const {
    return state_->torn;
}

double RecordFileReader::progress() const {
    return state_->ended ? 1.0
                         : static_cast<double>(state_->at) /
                               static_cast<double>(std::max<std::uint64_t>(1, size()));
}

}  // namespace hybrid_slam
