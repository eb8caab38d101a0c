// SPDX-License-Identifier: Apache-2.0
#include "disk.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace hybrid_slam::disk {

namespace {

void write_all(int descriptor, const std::filesystem::path& file, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t count = ::write(descriptor, bytes.data(), bytes.size());
        if (count < 0 && errno != EINTR) {
            throw last_error(file);
        }
        bytes.remove_prefix(count < 0 ? 0 : static_cast<std::size_t>(count));
    }
}

void write_part(const std::filesystem::path& part, const std::filesystem::path& file,
                std::string_view bytes) {
    const Descriptor descriptor(part, O_WRONLY | O_CREAT | O_TRUNC, 0644);
    write_all(descriptor.number(), file, bytes);
    if (::fsync(descriptor.number()) != 0) {
        throw last_error(file);
    }
}

}  // namespace

Error last_error(const std::filesystem::path& file) {
    return Error(file.string() + ": " + std::generic_category().message(errno));
}

Descriptor::Descriptor(const std::filesystem::path& file, int flags, unsigned mode)
    : number_(::open(file.c_str(), flags | O_CLOEXEC, mode)) {
    if (number_ < 0) {
        throw last_error(file);
    }
}

Descriptor::~Descriptor() {
    if (number_ >= 0) {
        ::close(number_);
    }
}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
}

void sync_folder(const std::filesystem::path& folder) {
    const std::filesystem::path place = folder.empty() ? "." : folder;
    const Descriptor descriptor(place, O_RDONLY | O_DIRECTORY);
    // Some file systems do not sync folders (EINVAL): those have nothing to lose.
    if (::fsync(descriptor.number()) != 0 && errno != EINVAL) {
        throw last_error(place);
    }
}

void replace_file(const std::filesystem::path& file, std::string_view bytes) {
    std::filesystem::path part = file;
    part += ".part";
    try {
        write_part(part, file, bytes);
        std::error_code error;
        std::filesystem::rename(part, file, error);
        if (error) {
            throw Error(file.string() + ": " + error.message());
        }
    } catch (...) {
        std::error_code ignored;
        std::filesystem::remove(part, ignored);
        throw;
    }
    sync_folder(file.parent_path());
}

}  // namespace hybrid_slam::disk
