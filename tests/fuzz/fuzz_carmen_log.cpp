// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdlib>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/logs/carmen_log.hpp"
#include "input_file.hpp"

namespace {

void require(bool condition) {
    if (!condition) {
        std::abort();
    }
}

/// A log that was taken is read to its end without a throw, and yields only finite stamps and
/// poses.
void read_to_the_end(hybrid_slam::CarmenLog& log) noexcept {
    std::size_t scans = 0;
    while (const auto measurement = log.next()) {
        if (const auto* scan = std::get_if<hybrid_slam::Scan>(&*measurement)) {
            ++scans;
            require(std::isfinite(scan->stamp) && scan->angle_increment > 0.0);
            require(!scan->ranges.empty() && scan->robot_from_laser.vector().allFinite());
        } else if (const auto* odom = std::get_if<hybrid_slam::WheelOdometry>(&*measurement)) {
            require(std::isfinite(odom->stamp) && odom->odom_from_robot.vector().allFinite());
        }
    }
    require(scans == log.counts().scans);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const hybrid_slam::fuzz::InputFile input(data, size);
    try {
        hybrid_slam::CarmenLog log(input.path());
        read_to_the_end(log);
    } catch (const hybrid_slam::Error&) {
        // Refused at construction, which is allowed.
    }
    return 0;
}
