// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "can_open.hpp"
#include "cia402.hpp"
#include "drive_codecs.hpp"
#include "little_endian.hpp"
#include "wheel_motion.hpp"

namespace hybrid_slam {
namespace {

using cia402::PowerState;

/// One controller as we know it.
class Node {
  public:
    Node(int number, std::uint8_t mode) : number_(number), mode_(mode) {}

    /// Operational, and the mode written to 0x6060: an expedited SDO of one byte.
    std::vector<CanFrame> start(bool operational) const {
        std::vector<CanFrame> frames;
        if (operational) {
            frames.push_back(can_open::start_node(number_));
        }
        frames.push_back(CanFrame::of(can_open::id(can_open::kSdoRequest, number_),
                                      {0x2F, 0x60, 0x60, 0x00, mode_, 0, 0, 0}));
        return frames;
    }

    CanFrame command(std::uint16_t controlword, double target) const {
        CanFrame frame = CanFrame::of(can_open::id(can_open::kRpdo1, number_), {0, 0, 0, 0, 0, 0});
        put(frame, 0, controlword, 2);
        constexpr double kMost = 2147483647.0;
        put(frame, 2, std::llround(std::clamp(target, -kMost, kMost)), 4);
        return frame;
    }

    /// The next step towards power on, or off. A fault is reset once for each time that power is
    /// asked for anew: one that comes while driving must not clear itself.
    std::uint16_t controlword(bool enabled) {
        may_reset_ = enabled && (may_reset_ || !was_enabled_);
        was_enabled_ = enabled;
        if (state_ == PowerState::kEnabled) {
            may_reset_ = false;
        }
        if (!enabled || !state_) {
            return cia402::kShutdown;
        }
        switch (*state_) {
            case PowerState::kReady:
                return cia402::kSwitchOn;
            case PowerState::kSwitchedOn:
            case PowerState::kEnabled:
                return cia402::kEnable;
            case PowerState::kFault:
                return may_reset_ ? cia402::kFaultReset : cia402::kDisableVoltage;
            case PowerState::kFaultReaction:
            case PowerState::kQuickStop:
                return cia402::kDisableVoltage;
            default:
                return cia402::kShutdown;
        }
    }

    bool decode(const CanFrame& frame) {
        if (can_open::is(frame, can_open::id(can_open::kTpdo1, number_), 6)) {
            state_ = cia402::power_state(unsigned_at(frame, 0, 2));
            actual_ = i32_at(frame, 2);
            return true;
        }
        if (can_open::is(frame, can_open::id(can_open::kEmergency, number_), 2)) {
            code_ = static_cast<int>(unsigned_at(frame, 0, 2));
            return true;
        }
        return false;
    }

    bool enabled() const { return state_ == PowerState::kEnabled; }
    std::optional<double> actual() const { return actual_; }
    int fault() const {
        const bool faulty = state_ == PowerState::kFault || state_ == PowerState::kFaultReaction;
        return faulty ? (code_ == 0 ? -1 : code_) : 0;
    }

  private:
    int number_;
    std::uint8_t mode_;
    std::optional<PowerState> state_;
    std::optional<double> actual_;
    int code_ = 0;
    bool was_enabled_ = false;
    bool may_reset_ = false;
};

class Cia402Codec : public DriveCodec {
  public:
    Cia402Codec(const DriveLayout& layout, const VehicleConfig& vehicle)
        : layout_(layout),
          vehicle_(vehicle),
          drive_(layout.node, cia402::kProfileVelocity),
          wheel_(layout.steering_node, cia402::kCyclicPosition) {}

    std::vector<CanFrame> start() const override {
        std::vector<CanFrame> frames = drive_.start(layout_.start_nodes);
        const std::vector<CanFrame> more = wheel_.start(layout_.start_nodes);
        frames.insert(frames.end(), more.begin(), more.end());
        return frames;
    }

    std::vector<CanFrame> encode(const DriveCommand& command, bool enabled) override {
        const DriveCommand wanted = within_limits(vehicle_, command);
        const bool driven = enabled && drive_.enabled() && wheel_.enabled();
        double velocity = 0.0;
        if (driven) {
            const double rpm = rpm_from_speed(layout_, wanted.speed,
                                              straighter(wanted.steering, measured_steering()));
            velocity =
                layout_.velocity_per_rpm * std::clamp(rpm, -layout_.rpm_limit, layout_.rpm_limit);
        }
        // A wheel without power is told to stay where it is, so that power does not jerk it.
        double position = wheel_.actual().value_or(0.0);
        if (enabled && wheel_.enabled()) {
            position = layout_.position_per_degree * truck_degrees(layout_, wanted.steering);
        }
        return {drive_.command(drive_.controlword(enabled), velocity),
                wheel_.command(wheel_.controlword(enabled), position)};
    }

    std::optional<DriveFeedback> decode(const CanFrame& frame) override {
        if (!drive_.decode(frame) && !wheel_.decode(frame)) {
            return std::nullopt;
        }
        DriveFeedback feedback;
        feedback.steering = measured_steering();
        if (drive_.actual() && (feedback.steering || layout_.speed_of == SpeedOf::kAxle)) {
            feedback.speed = speed_from_rpm(layout_, *drive_.actual() / layout_.velocity_per_rpm,
                                            feedback.steering.value_or(0.0));
        }
        feedback.drive_fault = drive_.fault();
        feedback.steering_fault = wheel_.fault();
        feedback.ready = drive_.enabled() && wheel_.enabled();
        return feedback;
    }

  private:
    std::optional<double> measured_steering() const {
        if (!wheel_.actual()) {
            return std::nullopt;
        }
        return steering_from(layout_, *wheel_.actual() / layout_.position_per_degree);
    }

    DriveLayout layout_;
    VehicleConfig vehicle_;
    Node drive_;
    Node wheel_;
};

}  // namespace

std::unique_ptr<DriveCodec> make_cia402_codec(const DriveLayout& layout,
                                              const VehicleConfig& vehicle) {
    return std::make_unique<Cia402Codec>(layout, vehicle);
}

}  // namespace hybrid_slam
