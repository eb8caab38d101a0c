// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "hybrid_slam/core/points.hpp"

namespace hybrid_slam {

/// Bytes of a file, little-endian on every machine. All throw Error that names the file.
class ByteWriter {
  public:
    explicit ByteWriter(std::string file) : file_(std::move(file)) {}

    void put_text(std::string_view text) { bytes_ += text; }
    void put_count(std::size_t count);  ///< as 32 bits
    void put_double(double value);      ///< must be finite
    void put_pose(const Pose2d& pose);
    void put_floats(const Points& points);

    const std::string& bytes() const { return bytes_; }

  private:
    template <typename Bits>
    void put_bits(Bits bits);
    void put_float(double value);
    void expect_finite(double value) const;

    std::string file_;
    std::string bytes_;
};

/// Trusts no count before it has been held against the bytes that are left. All throw Error that
/// names the file.
class ByteReader {
  public:
    explicit ByteReader(const std::filesystem::path& file);

    [[noreturn]] void fail(const std::string& why) const;

    /// The first eight bytes and the version after them.
    void expect_head(std::string_view magic, std::uint32_t version, const char* what);
    void expect_end() const;

    std::string_view text(std::size_t size);
    std::uint32_t number();
    std::size_t count(std::size_t record_bytes);  ///< of records of at least so many bytes each
    double real();                                ///< finite
    Pose2d pose();
    Points points(std::size_t count);

  private:
    std::size_t left() const { return bytes_.size() - at_; }
    template <typename Bits>
    Bits bits();
    double small_real();
    double finite(double value) const;

    std::string file_;
    std::string bytes_;
    std::size_t at_ = 0;
};

}  // namespace hybrid_slam
