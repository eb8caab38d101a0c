// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>
#include <utility>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam::disk {

/// What errno says, with the name of the file.
Error last_error(const std::filesystem::path& file);

/// An open file, closed at its end.
class Descriptor {
  public:
    Descriptor() = default;
    /// Throws Error. `flags` and `mode` as of open(2).
    Descriptor(const std::filesystem::path& file, int flags, unsigned mode = 0);
    ~Descriptor();
    Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept;

    int number() const { return number_; }

  private:
    int number_ = -1;
};

/// So that the names of the files in it outlive a power cut. Throws Error.
void sync_folder(const std::filesystem::path& folder);

/// Puts a file with these bytes there, at once and for good: after a power cut there is the old one
/// or the new one. Throws Error.
void replace_file(const std::filesystem::path& file, std::string_view bytes);

}  // namespace hybrid_slam::disk
