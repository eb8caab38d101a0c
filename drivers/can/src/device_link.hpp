// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace hybrid_slam {

/// A symbolic link that gives a device a name for as long as it lives.
class DeviceLink {
  public:
    /// A link that is there already is replaced. Throws Error when the name is taken by something
    /// else or cannot be made.
    DeviceLink(std::filesystem::path link, std::string device);
    /// Leaves a link alone that somebody has put in its place meanwhile.
    ~DeviceLink();
    DeviceLink(const DeviceLink&) = delete;
    DeviceLink& operator=(const DeviceLink&) = delete;

  private:
    std::filesystem::path link_;
    std::string device_;
};

}  // namespace hybrid_slam
