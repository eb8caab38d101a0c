// SPDX-License-Identifier: Apache-2.0
#include "vision.hpp"

#include <algorithm>

namespace hybrid_slam {

std::vector<std::string> vision_topics() {
    return {"hall", "slow", "corridor", "faults", "kitti", "speed"};
}

int run_vision_benchmark(const VisionOptions& options, std::ostream& out) {
    using Measure = int (*)(const VisionOptions&, std::ostream&);
    const std::vector<Measure> all{measure_hall,   measure_slow_loop, measure_corridor,
                                   measure_faults, measure_kitti,     measure_vision_speed};
    const std::vector<std::string> names = vision_topics();
    int misses = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
        if (std::find(options.topics.begin(), options.topics.end(), names[i]) !=
            options.topics.end()) {
            misses += all[i](options, out);
        }
    }
    return misses;
}

}  // namespace hybrid_slam
