// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hybrid_slam::tools {

enum class ServedDevice { kLidar, kCamera, kCan };
std::string_view to_string(ServedDevice device);

struct Unplug {
    ServedDevice device = ServedDevice::kLidar;
    double from = 0.0;            ///< seconds
    std::optional<double> until;  ///< seconds; without it for good
};

/// lidar@10:12.5, can@5. Throws Error that names the text.
Unplug parse_unplug(const std::string& text);

/// Which device is plugged or pulled when.
class UnplugSchedule {
  public:
    explicit UnplugSchedule(const std::vector<Unplug>& unplugs);

    struct Change {
        double time = 0.0;
        ServedDevice device = ServedDevice::kLidar;
        bool plug = false;
    };
    /// Those up to `now` that were not given before, in the order of time.
    std::vector<Change> due(double now);

  private:
    std::vector<Change> changes_;
    std::size_t next_ = 0;
};

}  // namespace hybrid_slam::tools
