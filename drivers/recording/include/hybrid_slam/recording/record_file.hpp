// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

namespace hybrid_slam {

/// One entry of a record file: so many bytes and when they came.
struct Record {
    double arrival = 0.0;  ///< seconds, kept to the nanosecond
    std::vector<std::uint8_t> bytes;
};

/// Appends records to a file. Each is framed by a mark, its length and a checksum, so that a file
/// that was cut anywhere, or whose end was never written, gives back all records before. See
/// docs/formats.md.
class RecordFileWriter {
  public:
    /// Throws Error when the file exists or cannot be made.
    explicit RecordFileWriter(const std::filesystem::path& file);
    ~RecordFileWriter();
    RecordFileWriter(RecordFileWriter&&) noexcept;
    RecordFileWriter& operator=(RecordFileWriter&&) noexcept;

    /// Throws Error when the disk is full or broken; the records before stay readable.
    void append(double arrival, const std::uint8_t* bytes, std::size_t count);
    /// Returns when all records so far are on the disk (fdatasync). Throws Error.
    void sync();
    std::uint64_t bytes_written() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Reads records back, skipping and counting what is damaged.
class RecordFileReader {
  public:
    /// Throws Error when the file cannot be read or does not begin as a record file.
    explicit RecordFileReader(const std::filesystem::path& file);
    ~RecordFileReader();
    RecordFileReader(RecordFileReader&&) noexcept;
    RecordFileReader& operator=(RecordFileReader&&) noexcept;

    /// Empty at the end.
    std::optional<Record> next();
    std::uint64_t damaged_bytes() const;  ///< so far; in no intact record
    double progress() const;              ///< 0 to 1

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
