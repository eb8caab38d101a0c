// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "hybrid_slam/can/can_frame.hpp"
#include "hybrid_slam/can/drive_layout.hpp"

namespace hybrid_slam {

/// What a truck's controllers made of the frames: the motor's speed and the wheel's angle that they
/// now go for.
struct WheelCommand {
    double rpm = 0.0;
    double steering = 0.0;  ///< radians
    bool power = false;     ///< off: brakes on, the wheel stays where it is
};

/// One profile as the controllers in a truck speak it.
class TruckProtocol {
  public:
    TruckProtocol() = default;
    TruckProtocol(const TruckProtocol&) = delete;
    TruckProtocol& operator=(const TruckProtocol&) = delete;
    virtual ~TruckProtocol() = default;

    struct Answer {
        bool is_command = false;  ///< the frame was one that the truck drives by
        std::vector<CanFrame> frames;
    };
    virtual Answer receive(const CanFrame& frame) = 0;
    virtual WheelCommand command() const = 0;
    /// `rpm` of the motor, `steering` in radians, of the truck as it is now.
    virtual std::vector<CanFrame> feedback(double rpm, double steering) = 0;
    virtual void set_fault(int code) = 0;
};

std::unique_ptr<TruckProtocol> make_curtis_truck(const DriveLayout& layout);
std::unique_ptr<TruckProtocol> make_cia402_truck(const DriveLayout& layout);

}  // namespace hybrid_slam
