// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vision/visual_source.hpp"

#include <cmath>

#include "hybrid_slam/core/stopwatch.hpp"

namespace hybrid_slam {
namespace {

/// Seconds; a step back by more is a clock that was set, or that had been far ahead.
constexpr double kClockSet = 1.0;

}  // namespace

std::optional<Measurement> VisualSource::next() {
    while (true) {
        std::optional<Measurement> measurement = source_.next();
        if (!measurement) {
            return std::nullopt;
        }
        const Stopwatch clock;
        if (const auto* scan = std::get_if<Scan>(&*measurement)) {
            odometry_.see(*scan);
            counts_.seconds += clock.seconds();
            return measurement;
        }
        const auto* image = std::get_if<Image>(&*measurement);
        if (image == nullptr) {
            return measurement;
        }
        if (!std::isfinite(image->stamp) || (newest_ && image->stamp <= *newest_)) {
            ++counts_.backward;
            if (!std::isfinite(image->stamp) || image->stamp > *newest_ - kClockSet) {
                continue;
            }
            odometry_.restart();
        }
        if (!odometry_.accepts(*image)) {
            ++counts_.wrong_size;
            continue;
        }
        newest_ = image->stamp;
        const VisualMotion motion = odometry_.track(*image);
        ++counts_.images;
        ++counts_.statuses[motion.status];
        counts_.seconds += clock.seconds();
        return Measurement(motion);
    }
}

}  // namespace hybrid_slam
