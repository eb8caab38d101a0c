// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string>
#include <system_error>

#include "disk.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/recording/record_file.hpp"
#include "record_layout.hpp"

namespace hybrid_slam {

namespace {

using Piece = iovec;

Piece piece_of(const std::uint8_t* bytes, std::size_t count) {
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-const-cast): iovec serves reading and writing
    return {const_cast<std::uint8_t*>(bytes), count};
}

}  // namespace

struct RecordFileWriter::State {
    explicit State(const std::filesystem::path& file_in)
        : file(file_in), descriptor(file, O_WRONLY | O_CREAT | O_EXCL, 0644) {}

    void write(Piece first, Piece second);

    std::filesystem::path file;
    disk::Descriptor descriptor;
    std::uint64_t end = 0;  ///< behind the last whole record
};

/// Both pieces at the end of the file, or nothing. One call each: the system's own buffer is all
/// that lies between a record and the disk, so that what a full disk refuses is known record by
/// record.
void RecordFileWriter::State::write(Piece first, Piece second) {
    Piece pieces[] = {first, second};
    std::uint64_t at = end;
    while (pieces[0].iov_len + pieces[1].iov_len > 0) {
        const ssize_t count = ::pwritev(descriptor.number(), pieces, 2, static_cast<off_t>(at));
        if (count < 0 && errno == EINTR) {
            continue;
        }
        if (count < 0) {
            const Error error = disk::last_error(file);
            // Best effort: what stays behind is overwritten by the next record, or torn.
            [[maybe_unused]] const int ignored =
                ::ftruncate(descriptor.number(), static_cast<off_t>(end));
            throw error;
        }
        at += static_cast<std::uint64_t>(count);
        auto left = static_cast<std::size_t>(count);
        for (Piece& piece : pieces) {
            const std::size_t taken = std::min(left, piece.iov_len);
            piece.iov_base = static_cast<std::uint8_t*>(piece.iov_base) + taken;
            piece.iov_len -= taken;
            left -= taken;
        }
    }
    end = at;
}

RecordFileWriter::RecordFileWriter(const std::filesystem::path& file)
    : state_(std::make_unique<State>(file)) {
    const record_layout::FileHeader header = record_layout::file_header();
    try {
        state_->write(piece_of(header.data(), header.size()), piece_of(nullptr, 0));
        sync();
        disk::sync_folder(file.parent_path());
    } catch (...) {
        std::error_code ignored;
        std::filesystem::remove(file, ignored);
        throw;
    }
}

RecordFileWriter::~RecordFileWriter() = default;
RecordFileWriter::RecordFileWriter(RecordFileWriter&&) noexcept = default;
RecordFileWriter& RecordFileWriter::operator=(RecordFileWriter&&) noexcept = default;

void RecordFileWriter::append(double arrival, const std::uint8_t* bytes, std::size_t count) {
    if (!(std::abs(arrival) <= record_layout::kMostSeconds)) {
        throw Error(state_->file.string() + ": an arrival that is no time");
    }
    if (count > kMostBytes) {
        throw Error(state_->file.string() + ": " + std::to_string(count) +
                    " bytes are too many for one record");
    }
    const record_layout::RecordHeader header = record_layout::encode(
        {static_cast<std::uint32_t>(count), record_layout::nanoseconds_of(arrival),
         record_layout::crc_of(bytes, count)});
    state_->write(piece_of(header.data(), header.size()), piece_of(bytes, count));
}

void RecordFileWriter::sync() {
    if (::fdatasync(state_->descriptor.number()) != 0) {
        throw disk::last_error(state_->file);
    }
}

std::uint64_t RecordFileWriter::bytes_written() const {
    return state_->end;
}

}  // namespace hybrid_slam
