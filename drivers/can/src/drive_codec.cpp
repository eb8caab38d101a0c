// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/can/drive_codec.hpp"

#include <algorithm>
#include <cmath>

#include "drive_codecs.hpp"
#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {

void check(const DriveLayout& layout) {
    if (layout.profile == DriveProfile::kCia402 && layout.node == layout.steering_node) {
        throw Error("can.steering_node: must be another one than can.node");
    }
}

DriveCommand within_limits(const VehicleConfig& vehicle, const DriveCommand& command) {
    if (!std::isfinite(command.speed) || !std::isfinite(command.steering)) {
        throw Error("drive command: speed and steering must be finite");
    }
    return {std::clamp(command.speed, -vehicle.speed_limit, vehicle.speed_limit),
            std::clamp(command.steering, -vehicle.steering_limit, vehicle.steering_limit)};
}

std::unique_ptr<DriveCodec> make_drive_codec(const DriveLayout& layout,
                                             const VehicleConfig& vehicle) {
    check(layout);
    return layout.profile == DriveProfile::kCurtis ? make_curtis_codec(layout, vehicle)
                                                   : make_cia402_codec(layout, vehicle);
}

}  // namespace hybrid_slam
