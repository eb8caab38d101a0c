// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace hybrid_slam {

/// Reads a text file line by line, plain or gzip alike (zlib tells them apart by content).
class TextFileReader {
  public:
    /// Throws Error when the file cannot be opened or is a folder.
    explicit TextFileReader(const std::filesystem::path& file);
    ~TextFileReader();
    TextFileReader(TextFileReader&&) noexcept;
    TextFileReader& operator=(TextFileReader&&) noexcept;

    /// Puts the next line into `line`, without its end (LF or CRLF); false at the end of the file.
    /// A truncated or corrupt gzip ends the file there and sets `corrupt()`.
    bool next(std::string& line);

    std::size_t line_number() const;  ///< of the line last read, from 1
    bool corrupt() const;
    /// The last line read had no line end: it may be torn.
    bool unterminated() const;
    double progress() const;  ///< share of the file's bytes consumed, 0 to 1
    /// "file:line"
    std::string where() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Where a file of this name is to be put: links are followed. Throws Error for a folder, a device,
/// a pipe and whatever else must not be replaced by a file.
std::filesystem::path replaceable_file(const std::filesystem::path& file);

/// Writes a text file, gzip when its name ends in .gz. Appears under its name only when `close`
/// succeeds (it is written beside and renamed), so that a crash leaves no half file.
class TextFileWriter {
  public:
    /// Throws Error when the file cannot be created.
    explicit TextFileWriter(const std::filesystem::path& file);
    ~TextFileWriter();  ///< without close: removes what was written
    TextFileWriter(TextFileWriter&&) noexcept;
    TextFileWriter& operator=(TextFileWriter&&) noexcept;

    void write(std::string_view text);  ///< throws Error when the disk is full
    void close();                       ///< throws Error when not everything reached the file

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// The bytes of a file as they are (gzip is not undone). Throws Error when it cannot be read or
/// holds more than `most_bytes`.
std::string read_whole_file(const std::filesystem::path& file, std::size_t most_bytes);

/// Splits at blanks and tabs; views into `line`.
class Tokens {
  public:
    explicit Tokens(std::string_view line) : rest_(line) {}
    /// The next token; empty at the end of the line.
    std::string_view next();

  private:
    std::string_view rest_;
};

/// The whole token as a number, independent of the locale (inf and nan in any case included, a
/// leading plus too); false, with `value` untouched, when it is none or does not fit.
bool parse_double(std::string_view token, double& value);
bool parse_long(std::string_view token, long& value);

}  // namespace hybrid_slam
