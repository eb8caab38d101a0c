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

/// Appends records to a file. Each is framed by a mark, its length and checksums, so that a file
/// that was cut anywhere, or whose end was never written, gives back all records before. See
/// docs/formats.md. A record is with the system when append returns (a killed program loses none)
/// and on the disk when sync returns (nor does a power cut).
class RecordFileWriter {
  public:
    static constexpr std::size_t kMostBytes = std::size_t{1} << 26U;  ///< of one record

    /// Throws Error when the file exists or cannot be made.
    explicit RecordFileWriter(const std::filesystem::path& file);
    ~RecordFileWriter();
    RecordFileWriter(RecordFileWriter&&) noexcept;
    RecordFileWriter& operator=(RecordFileWriter&&) noexcept;

    /// All or nothing: throws Error when the disk is full or broken, and the records before stay
    /// readable; may be tried again. Throws Error for an arrival that is no time, and for more than
    /// kMostBytes.
    void append(double arrival, const std::uint8_t* bytes, std::size_t count);
    /// Returns when all records so far are on the disk (fdatasync). Throws Error.
    void sync();
    std::uint64_t bytes_written() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Reads records back, skipping and counting what is damaged. A file that still grows is read up to
/// where it ended at the opening.
class RecordFileReader {
  public:
    /// Throws Error when the file cannot be read or is no record file. One that a crash left empty
    /// or with zeros only has no records.
    explicit RecordFileReader(const std::filesystem::path& file);
    ~RecordFileReader();
    RecordFileReader(RecordFileReader&&) noexcept;
    RecordFileReader& operator=(RecordFileReader&&) noexcept;

    /// Empty at the end. Throws Error when the disk gives the bytes no more.
    std::optional<Record> next();
    /// Goes on with the first intact record that begins at this byte of the file or behind it; what
    /// is skipped on the way does not count as damage.
    void seek(std::uint64_t offset);

    std::uint64_t position() const;  ///< the byte behind the record last read
    std::uint64_t size() const;      ///< bytes of the file
    /// Bytes before the record last read that are in no intact one.
    std::uint64_t damaged_bytes() const;
    /// Bytes behind the last intact record, once next was empty: an end that was never written.
    std::uint64_t torn_bytes() const;
    double progress() const;  ///< 0 to 1

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hybrid_slam
