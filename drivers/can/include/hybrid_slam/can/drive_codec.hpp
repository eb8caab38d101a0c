// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "hybrid_slam/can/can_frame.hpp"
#include "hybrid_slam/can/drive_layout.hpp"
#include "hybrid_slam/vehicle/forklift.hpp"

namespace hybrid_slam {

/// What the truck has said so far; what it has not said is missing.
struct DriveFeedback {
    std::optional<double> speed;     ///< m/s of the fixed axle
    std::optional<double> steering;  ///< radians, positive: the wheel points to the left
    std::optional<double> battery;   ///< share of full, 0 to 1
    /// The controllers' own codes, 0 = none, -1 = one without a code.
    int drive_fault = 0;
    int steering_fault = 0;
    bool ready = false;  ///< the power stages are on (cia402); curtis does not tell: always

    bool faulty() const { return drive_fault != 0 || steering_fault != 0; }
};

/// Commands to frames and frames to feedback, as a DriveLayout says. For one truck and one thread:
/// it remembers what the truck said.
class DriveCodec {
  public:
    DriveCodec() = default;
    DriveCodec(const DriveCodec&) = delete;
    DriveCodec& operator=(const DriveCodec&) = delete;
    virtual ~DriveCodec() = default;

    /// What makes the truck's controllers listen and talk: once at the start, and again while they
    /// are silent.
    virtual std::vector<CanFrame> start() const = 0;

    /// The frames of one cycle. Not enabled: power off and brakes on, whatever the command. Speed
    /// and steering are clamped to the vehicle's limits. Throws Error for a command that is not
    /// finite.
    virtual std::vector<CanFrame> encode(const DriveCommand& command, bool enabled) = 0;

    /// All that is known with this frame; nothing when it is none of the layout's.
    virtual std::optional<DriveFeedback> decode(const CanFrame& frame) = 0;
};

/// Throws Error when node and steering_node of a cia402 layout are the same.
std::unique_ptr<DriveCodec> make_drive_codec(const DriveLayout& layout,
                                             const VehicleConfig& vehicle);

}  // namespace hybrid_slam
