// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/can/truck_can.hpp"

#include <algorithm>

#include "drive_codecs.hpp"
#include "truck_protocol.hpp"
#include "wheel_motion.hpp"

namespace hybrid_slam {
namespace {

// While the wheel turns, the axle's speed changes with it: steps must be short beside that.
constexpr double kLongestStep = 0.005;  // seconds

void append(std::vector<CanFrame>& all, const std::vector<CanFrame>& more) {
    all.insert(all.end(), more.begin(), more.end());
}

}  // namespace

TruckCan::TruckCan(const DriveLayout& layout, const VehicleConfig& vehicle,
                   const VehicleState& state, double now)
    : layout_(layout),
      vehicle_(vehicle),
      state_(state),
      start_(now),
      now_(now),
      last_command_(now - kCommandValid) {
    check(layout);
    protocol_ = layout.profile == DriveProfile::kCurtis ? make_curtis_truck(layout)
                                                        : make_cia402_truck(layout);
}

TruckCan::~TruckCan() = default;

bool TruckCan::driven() const {
    return protocol_->command().power && now_ - last_command_ < kCommandValid;
}

void TruckCan::set_fault(int code) {
    protocol_->set_fault(code);
}

std::vector<CanFrame> TruckCan::receive(const CanFrame& frame, double now) {
    std::vector<CanFrame> frames = advance(now);
    const TruckProtocol::Answer answer = protocol_->receive(frame);
    if (answer.is_command) {
        last_command_ = now_;
    }
    append(frames, answer.frames);
    return frames;
}

std::vector<CanFrame> TruckCan::advance(double now) {
    std::vector<CanFrame> frames;
    while (now_ < now) {
        // By counting, so that no error adds up.
        const double next_feedback = start_ + static_cast<double>(feedbacks_ + 1) * kFeedbackPeriod;
        const double until = std::min({now, next_feedback, now_ + kLongestStep});
        move(until - now_);
        now_ = until;
        if (now_ >= next_feedback) {
            ++feedbacks_;
            const double rpm = rpm_from_speed(layout_, state_.speed, state_.steering);
            append(frames, protocol_->feedback(rpm, state_.steering));
        }
    }
    return frames;
}

void TruckCan::move(double seconds) {
    DriveCommand command{0.0, state_.steering};
    if (driven()) {
        const WheelCommand wheel = protocol_->command();
        command = {speed_from_rpm(layout_, wheel.rpm, state_.steering), wheel.steering};
    }
    state_ = step(vehicle_, state_, command, seconds);
}

}  // namespace hybrid_slam
