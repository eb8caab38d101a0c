// SPDX-License-Identifier: Apache-2.0
#include "checked_drive.hpp"

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
SimulatedDriveConfig checked_drive(SimulatedDriveConfig config, const RobotConfig& robot) {
    ConfigSchema schema;
    const ConfigSchema::Section section(schema, "drive");
    describe(schema, config);  // throws for values out of their ranges
    if (config.speed > robot.vehicle.speed_limit) {
        throw Error("drive.speed: above the vehicle's speed_limit");
    }
    steerable(robot.vehicle);
    if (robot.lidar.protocol != LidarProtocol::kS300) {
        throw Error("lidar.protocol: the simulated scanner speaks s300 alone");
    }
    return config;
}

}  // namespace hybrid_slam
