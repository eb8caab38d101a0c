// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "hybrid_slam/can/can_frame.hpp"
#include "hybrid_slam/can/drive_layout.hpp"
#include "hybrid_slam/vehicle/forklift.hpp"

namespace hybrid_slam {

class TruckProtocol;

/// The truck's end of the bus, for a simulator: obeys commands as a DriveLayout says them, moves by
/// `step`, tells its speed and steering 50 times a second, and stops by itself when no command came
/// for `kCommandValid`. The clock is the caller's; nothing here waits.
class TruckCan {
  public:
    static constexpr double kCommandValid = 0.3;     ///< seconds
    static constexpr double kFeedbackPeriod = 0.02;  ///< seconds

    /// Stands at `state` at the time `now`, in seconds. Throws Error as make_drive_codec does.
    TruckCan(const DriveLayout& layout, const VehicleConfig& vehicle, const VehicleState& state,
             double now);
    ~TruckCan();
    TruckCan(const TruckCan&) = delete;
    TruckCan& operator=(const TruckCan&) = delete;

    /// A frame of the bus that arrives at `now`, to which the truck moves first. Frames that are
    /// not for the truck are passed over. The result is what it sent until then, and its answer.
    std::vector<CanFrame> receive(const CanFrame& frame, double now);

    /// Moves on to `now`, and gives the frames that the truck sent on the way. A time that is not
    /// later changes nothing.
    std::vector<CanFrame> advance(double now);

    const VehicleState& state() const { return state_; }
    /// Power is on and commands are fresh.
    bool driven() const;

    /// A fault of the drive's controller: it takes its power off and tells the code, until it is
    /// cleared with 0 (curtis) or reset by the bus (cia402).
    void set_fault(int code);

  private:
    void move(double seconds);

    DriveLayout layout_;
    VehicleConfig vehicle_;
    VehicleState state_;
    std::unique_ptr<TruckProtocol> protocol_;
    double start_ = 0.0;
    double now_ = 0.0;
    double last_command_ = 0.0;
    long feedbacks_ = 0;
};

}  // namespace hybrid_slam
