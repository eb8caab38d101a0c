// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

namespace hybrid_slam::fuzz {

/// The fuzzer's bytes as a file, for the readers take paths. One for each process, so that several
/// may run side by side.
class InputFile {
  public:
    InputFile(const std::uint8_t* data, std::size_t size)
        : path_(std::filesystem::temp_directory_path() /
                ("hybrid_slam_fuzz_" + std::to_string(::getpid()))) {
        std::ofstream out(path_, std::ios::binary);
        out.write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    }
    ~InputFile() {
        std::error_code ignored;
        std::filesystem::remove(path_, ignored);
    }
    InputFile(const InputFile&) = delete;
    InputFile& operator=(const InputFile&) = delete;

    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

}  // namespace hybrid_slam::fuzz
