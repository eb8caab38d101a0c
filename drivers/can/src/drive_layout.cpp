// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/can/drive_layout.hpp"

namespace hybrid_slam {

void describe(ConfigSchema& schema, DriveLayout& layout) {
    schema.add("profile", layout.profile,
               {{"curtis", DriveProfile::kCurtis}, {"cia402", DriveProfile::kCia402}},
               "curtis: one frame for speed and steering; cia402: a drive and a steering node");
    schema.add("node", layout.node, 1, 127, "of the drive's controller: 3 gives 0x203");
    schema.add("steering_node", layout.steering_node, 1, 127, "of the steering's, cia402 only");
    schema.add("start_nodes", layout.start_nodes, "send CANopen's start to the nodes");
    schema.add("speed_of", layout.speed_of, {{"axle", SpeedOf::kAxle}, {"wheel", SpeedOf::kWheel}},
               "wheel: the steered wheel is driven, and runs 1 / cos(steering) faster; or axle");
    schema.add("gear", layout.gear, 0.01, 1000.0, "turns of the motor for one of the wheel");
    schema.add("wheel_radius", layout.wheel_radius, 0.01, 2.0, "m, of the wheel of speed_of");
    schema.add("drive_inverted", layout.drive_inverted, "the truck's forward is our backward");
    schema.add("steering_inverted", layout.steering_inverted, "the truck counts left negative");
    schema.add("rpm_limit", layout.rpm_limit, 1.0, 65535.0, "1/min, of the motor");
    schema.add("acceleration_time", layout.acceleration_time, 0.1, 25.5, "s, curtis only");
    schema.add("deceleration_time", layout.deceleration_time, 0.1, 25.5, "s, curtis only");
    schema.add("steering_fault_byte", layout.steering_fault_byte, 0, 7,
               "curtis only, where 0x380 + node has it; 0 = nowhere");
    schema.add("velocity_per_rpm", layout.velocity_per_rpm, 1e-3, 1e5,
               "cia402: units of velocity for 1/min of the motor");
    schema.add("position_per_degree", layout.position_per_degree, 1e-2, 1e6,
               "cia402: units of position for a degree of steering");
}

}  // namespace hybrid_slam
