// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vision/visual_source.hpp"

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/stopwatch.hpp"

namespace hybrid_slam {

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
        if (newest_ && !(image->stamp > *newest_)) {
            ++counts_.backward;
            continue;
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
