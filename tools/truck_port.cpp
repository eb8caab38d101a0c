// SPDX-License-Identifier: Apache-2.0
#include "truck_port.hpp"

#include <chrono>
#include <cmath>
#include <exception>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr double kRetry = 1.0;      ///< seconds between attempts to open the bus
constexpr double kFirstWord = 1.5;  ///< seconds that the truck has for its first feedback

}  // namespace

TruckPort::TruckPort(const CanDriveConfig& config, const VehicleConfig& vehicle,
                     CanDrive::Clock clock)
    : config_(config), vehicle_(vehicle), clock_(std::move(clock)), drive_(open()) {}

std::unique_ptr<CanDrive> TruckPort::open() const {
    return std::make_unique<CanDrive>(open_can_bus(config_.bus), config_, vehicle_, clock_);
}

/// An adapter that does not answer takes its time, which the driving loop has not.
void TruckPort::reopen(double now) {
    if (!opening_.valid() && now >= next_attempt_) {
        next_attempt_ = now + kRetry;
        opening_ = std::async(std::launch::async, [this] { return open(); });
        return;
    }
    if (!opening_.valid() ||
        opening_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
        return;
    }
    try {
        drive_ = opening_.get();
        ++reconnects_;
        first_look_ = now;
        was_fed_ = false;
        print_info(config_.bus.port + ": works again");
    } catch (const std::exception& error) {
        fault_ = error.what();
    }
}

DriveReading TruckPort::reading(double now) {
    if (!drive_) {
        reopen(now);
    }
    if (!drive_) {
        return {std::nullopt, std::nullopt, fault_};
    }
    status_ = drive_->status();
    if (status_.state == CanDriveState::kFault) {
        fault_ = status_.reason;
        print_warning(fault_ + "; it is opened anew as soon as it is there");
        drive_.reset();
        next_attempt_ = now + kRetry;
        return {std::nullopt, std::nullopt, fault_};
    }
    first_look_ = first_look_ < 0.0 ? now : first_look_;
    was_fed_ = was_fed_ || std::isfinite(status_.feedback_age);
    DriveReading reading{status_.feedback.speed, status_.feedback.steering, status_.reason};
    if (!was_fed_ && now - first_look_ < kFirstWord) {
        reading.fault.clear();  // it may not have had the time to say anything
    }
    return reading;
}

void TruckPort::apply(const PilotOutput& output) {
    if (!drive_) {
        return;
    }
    drive_->set_silent(output.manual);
    if (output.command) {
        drive_->set_command(*output.command);
    } else {
        drive_->stop();
    }
}

std::size_t TruckPort::step(std::size_t frames) {
    if (!drive_) {
        return 0;
    }
    const std::uint64_t before = drive_->status().counts.sent;
    drive_->step(frames);
    return static_cast<std::size_t>(drive_->status().counts.sent - before);
}

}  // namespace hybrid_slam::tools
