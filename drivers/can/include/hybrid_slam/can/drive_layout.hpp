// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid_slam/core/config.hpp"

namespace hybrid_slam {

enum class DriveProfile {
    /// Little endian, 11-bit ids. 0x200 + node, 8 bytes: flags (1 interlock, 2 forward, 4 reverse),
    /// u16 rpm, u8 acceleration and u8 deceleration in 0.1 s, i16 steering in 0.01 deg, u8 lowering
    /// valve, always 0. All zeros: brake. Feedback 0x180 + node: i16 rpm, u16 current, u8 fault, u8
    /// battery in percent; 0x380 + node: i16 steering in 0.01 deg, a fault code.
    kCurtis,
    /// CiA 402, two nodes. Drive, profile velocity (mode 3): 0x200 + node: controlword, i32 target
    /// velocity; 0x180 + node: statusword, i32 actual velocity. Steering, cyclic position (mode 8,
    /// which needs no handshake for each set point): 0x200 + steering_node: controlword, i32 target
    /// position; 0x180 + steering_node: statusword, i32 actual position. 0x080 + either: error
    /// code. The PDOs must be mapped so in the controllers; the modes are set by SDO at the start.
    kCia402
};

/// Whose speed the motor's is in proportion to.
enum class SpeedOf {
    kAxle,  ///< the fixed axle's, or the truck works it out itself
    kWheel  ///< the steered wheel is the driven one: it runs 1 / cos(steering) faster;
            ///< while it turns, of the straighter of the angles told and measured
};

/// How one truck's frames are to be understood. A steered wheel that is ahead or behind makes no
/// difference here: steering counts to the left at either end.
struct DriveLayout {
    DriveProfile profile = DriveProfile::kCurtis;
    int node = 3;             ///< of the drive's controller, 1 to 127
    int steering_node = 4;    ///< of the steering's, cia402 only
    bool start_nodes = true;  ///< sends the CANopen command that makes the nodes operational
    SpeedOf speed_of = SpeedOf::kWheel;
    double gear = 21.96;                 ///< turns of the motor for one of the wheel
    double wheel_radius = 0.15;          ///< metres, of the wheel that `speed_of` names
    bool drive_inverted = false;         ///< the truck's forward is the robot's backward
    bool steering_inverted = false;      ///< the truck counts left negative
    double rpm_limit = 4000.0;           ///< of the motor
    double acceleration_time = 1.0;      ///< seconds, curtis only
    double deceleration_time = 1.0;      ///< seconds, curtis only
    int steering_fault_byte = 2;         ///< curtis only; of 0x380 + node, trucks differ; 0 = none
    double velocity_per_rpm = 1.0;       ///< cia402: the drive's units for one rpm of its motor
    double position_per_degree = 100.0;  ///< cia402: the drive's units for a degree of the wheel
};

/// Lists the keys without a section before them.
void describe(ConfigSchema& schema, DriveLayout& layout);

}  // namespace hybrid_slam
