// SPDX-License-Identifier: Apache-2.0
#include "serve_unplug.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr ServedDevice kDevices[] = {ServedDevice::kLidar, ServedDevice::kCamera,
                                     ServedDevice::kCan};

std::optional<double> parse_seconds(std::string_view text) {
    double seconds = 0.0;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, seconds);
    const bool good = error == std::errc() && stop == end && std::isfinite(seconds);
    return good && seconds >= 0.0 ? std::optional(seconds) : std::nullopt;
}

}  // namespace

std::string_view to_string(ServedDevice device) {
    switch (device) {
        case ServedDevice::kLidar:
            return "lidar";
        case ServedDevice::kCamera:
            return "camera";
        case ServedDevice::kCan:
            return "can";
    }
    return "unknown";
}

Unplug parse_unplug(const std::string& text) {
    const std::string_view all = text;
    const std::size_t at = all.find('@');
    const std::string_view name = all.substr(0, at);
    const auto* device = std::find_if(std::begin(kDevices), std::end(kDevices),
                                      [&](ServedDevice each) { return to_string(each) == name; });
    if (at != std::string_view::npos && device != std::end(kDevices)) {
        const std::string_view times = all.substr(at + 1);
        const std::size_t colon = times.find(':');
        const auto from = parse_seconds(times.substr(0, colon));
        if (from && colon == std::string_view::npos) {
            return {*device, *from, std::nullopt};
        }
        const auto until =
            from && colon < times.size() ? parse_seconds(times.substr(colon + 1)) : std::nullopt;
        if (until && *until > *from) {
            return {*device, *from, until};
        }
    }
    throw Error("--unplug " + text +
                ": wanted is lidar, camera or can, @, and from when to when in seconds, as in "
                "lidar@10:12.5 or can@5");
}

UnplugSchedule::UnplugSchedule(const std::vector<Unplug>& unplugs) {
    for (const Unplug& unplug : unplugs) {
        changes_.push_back({unplug.from, unplug.device, false});
        if (unplug.until) {
            changes_.push_back({*unplug.until, unplug.device, true});
        }
    }
    std::stable_sort(changes_.begin(), changes_.end(),
                     [](const Change& a, const Change& b) { return a.time < b.time; });
}

std::vector<UnplugSchedule::Change> UnplugSchedule::due(double now) {
    std::vector<Change> due;
    while (next_ < changes_.size() && changes_[next_].time <= now) {
        due.push_back(changes_[next_++]);
    }
    return due;
}

}  // namespace hybrid_slam::tools
