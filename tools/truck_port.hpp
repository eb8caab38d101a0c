// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <future>
#include <memory>
#include <string>

#include "hybrid_slam/can/can_drive.hpp"
#include "hybrid_slam/pilot/pilot.hpp"

namespace hybrid_slam::tools {

/// The truck on its CAN bus; a bus that breaks is opened anew for as long as it takes, and the
/// truck cannot be driven meanwhile.
class TruckPort {
  public:
    /// Opens the bus. With a clock the drive has no thread; see CanDrive. Throws Error that names
    /// the port, what is wrong with it and what to do.
    TruckPort(const CanDriveConfig& config, const VehicleConfig& vehicle,
              CanDrive::Clock clock = {});

    /// What it says now. `now`: seconds, for the pace of new attempts.
    DriveReading reading(double now);
    void apply(const PilotOutput& output);
    /// One cycle of a drive with a clock. Returns how many frames it sent.
    std::size_t step(std::size_t frames);

    const CanDriveStatus& status() const { return status_; }
    std::uint64_t reconnects() const { return reconnects_; }

  private:
    std::unique_ptr<CanDrive> open() const;
    void reopen(double now);

    CanDriveConfig config_;
    VehicleConfig vehicle_;
    CanDrive::Clock clock_;
    std::unique_ptr<CanDrive> drive_;  ///< none while the bus is broken
    std::future<std::unique_ptr<CanDrive>> opening_;
    CanDriveStatus status_;
    std::string fault_;
    double next_attempt_ = 0.0;  ///< seconds
    bool was_fed_ = false;       ///< the truck has talked
    double first_look_ = -1.0;   ///< seconds
    std::uint64_t reconnects_ = 0;
};

}  // namespace hybrid_slam::tools
