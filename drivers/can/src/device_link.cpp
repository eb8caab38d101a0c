// SPDX-License-Identifier: Apache-2.0
#include "device_link.hpp"

#include <utility>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {

/// By renaming, so that whoever waits for the name never finds it missing.
DeviceLink::DeviceLink(std::filesystem::path link, std::string device)
    : link_(std::move(link)), device_(std::move(device)) {
    std::error_code error;
    const auto status = std::filesystem::symlink_status(link_, error);
    if (std::filesystem::exists(status) && !std::filesystem::is_symlink(status)) {
        throw Error(link_.string() + ": exists and is no symbolic link");
    }
    const std::filesystem::path fresh = link_.string() + ".new";
    std::filesystem::remove(fresh, error);
    std::filesystem::create_symlink(device_, fresh, error);
    if (!error) {
        std::filesystem::rename(fresh, link_, error);
    }
    if (error) {
        throw Error(link_.string() + ": " + error.message());
    }
}

DeviceLink::~DeviceLink() {
    std::error_code error;
    if (std::filesystem::read_symlink(link_, error) == device_) {
        std::filesystem::remove(link_, error);
    }
}

}  // namespace hybrid_slam
