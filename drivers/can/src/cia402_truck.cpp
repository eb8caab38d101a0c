// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "can_open.hpp"
#include "cia402.hpp"
#include "little_endian.hpp"
#include "truck_protocol.hpp"
#include "wheel_motion.hpp"

namespace hybrid_slam {
namespace {

using cia402::PowerState;

unsigned statusword(PowerState state) {
    switch (state) {
        case PowerState::kSwitchOnDisabled:
            return 0x40;
        case PowerState::kReady:
            return 0x21;
        case PowerState::kSwitchedOn:
            return 0x23;
        case PowerState::kEnabled:
            return 0x27;
        case PowerState::kQuickStop:
            return 0x07;
        case PowerState::kFaultReaction:
            return 0x0F;
        case PowerState::kFault:
            return 0x08;
        default:
            return 0x00;
    }
}

/// One controller: network management, the mode by SDO and the power state machine.
class Controller {
  public:
    Controller(int node, std::uint8_t mode, bool operational)
        : node_(node), needed_mode_(mode), operational_(operational) {}

    TruckProtocol::Answer receive(const CanFrame& frame) {
        if (can_open::is(frame, can_open::kNetworkManagement, 2) &&
            (frame.data[1] == 0 || frame.data[1] == node_)) {
            operational_ = frame.data[0] == can_open::kStartNode;
        } else if (can_open::is(frame, can_open::id(can_open::kSdoRequest, node_), 8)) {
            return {false, {answer(frame)}};
        } else if (operational_ && can_open::is(frame, can_open::id(can_open::kRpdo1, node_), 6)) {
            control(unsigned_at(frame, 0, 2));
            target_ = i32_at(frame, 2);
            return {true, {}};
        }
        return {};
    }

    bool powered() const {
        return operational_ && state_ == PowerState::kEnabled && mode_ == needed_mode_;
    }
    double target() const { return target_; }

    std::vector<CanFrame> feedback(double actual) {
        if (!operational_) {
            return {};
        }
        std::vector<CanFrame> frames;
        if (tell_code_) {
            CanFrame emergency =
                CanFrame::of(can_open::id(can_open::kEmergency, node_), {0, 0, 0, 0, 0, 0, 0, 0});
            put(emergency, 0, code_, 2);
            frames.push_back(emergency);
            tell_code_ = false;
        }
        CanFrame status = CanFrame::of(can_open::id(can_open::kTpdo1, node_), {0, 0, 0, 0, 0, 0});
        put(status, 0, statusword(state_), 2);
        put(status, 2, std::llround(actual), 4);
        frames.push_back(status);
        return frames;
    }

    void set_fault(int code) {
        code_ = code;
        tell_code_ = true;
        if (code != 0) {
            state_ = PowerState::kFault;
        }
    }

  private:
    /// Writes of one byte to 0x6060 are taken, all else is an unknown object.
    CanFrame answer(const CanFrame& request) {
        CanFrame reply =
            CanFrame::of(can_open::id(can_open::kSdoAnswer, node_), {0x60, 0, 0, 0, 0, 0, 0, 0});
        std::copy_n(request.data.begin() + 1, 3, reply.data.begin() + 1);
        if (request.data[0] == 0x2F && unsigned_at(request, 1, 3) == 0x6060) {
            mode_ = request.data[4];
        } else {
            constexpr std::uint32_t kNoSuchObject = 0x06020000;
            reply.data[0] = 0x80;
            put(reply, 4, kNoSuchObject, 4);
        }
        return reply;
    }

    void control(unsigned word) {
        const bool reset = (word & cia402::kFaultReset) != 0;
        if (state_ == PowerState::kFault) {
            if (reset && !last_reset_) {
                state_ = PowerState::kSwitchOnDisabled;
                set_fault(0);
            }
        } else if ((word & 0x6U) != 0x6U) {  // voltage off, or a quick stop at its end
            state_ = PowerState::kSwitchOnDisabled;
        } else if ((word & 0x7U) == cia402::kShutdown) {
            state_ = PowerState::kReady;
        } else if ((word & 0xFU) == cia402::kSwitchOn) {
            state_ = state_ == PowerState::kSwitchOnDisabled ? state_ : PowerState::kSwitchedOn;
        } else if ((word & 0xFU) == cia402::kEnable && state_ == PowerState::kSwitchedOn) {
            state_ = PowerState::kEnabled;
        }
        last_reset_ = reset;
    }

    int node_;
    std::uint8_t needed_mode_;
    std::uint8_t mode_ = 0;
    bool operational_;
    PowerState state_ = PowerState::kSwitchOnDisabled;
    double target_ = 0.0;
    bool last_reset_ = false;
    int code_ = 0;
    bool tell_code_ = false;
};

class Cia402Truck : public TruckProtocol {
  public:
    explicit Cia402Truck(const DriveLayout& layout)
        : layout_(layout),
          drive_(layout.node, cia402::kProfileVelocity, !layout.start_nodes),
          wheel_(layout.steering_node, cia402::kCyclicPosition, !layout.start_nodes) {}

    Answer receive(const CanFrame& frame) override {
        Answer answer = drive_.receive(frame);
        const Answer other = wheel_.receive(frame);
        answer.frames.insert(answer.frames.end(), other.frames.begin(), other.frames.end());
        // Only the drive's count as commands: speed is what must not outlive its sender.
        return answer;
    }

    WheelCommand command() const override {
        const bool power = drive_.powered() && wheel_.powered();
        const double rpm = drive_.target() / layout_.velocity_per_rpm;
        return {std::clamp(rpm, -layout_.rpm_limit, layout_.rpm_limit),
                steering_from(layout_, wheel_.target() / layout_.position_per_degree), power};
    }

    std::vector<CanFrame> feedback(double rpm, double steering) override {
        std::vector<CanFrame> frames = drive_.feedback(rpm * layout_.velocity_per_rpm);
        const std::vector<CanFrame> more =
            wheel_.feedback(truck_degrees(layout_, steering) * layout_.position_per_degree);
        frames.insert(frames.end(), more.begin(), more.end());
        return frames;
    }

    void set_fault(int code) override { drive_.set_fault(code); }

  private:
    DriveLayout layout_;
    Controller drive_;
    Controller wheel_;
};

}  // namespace

std::unique_ptr<TruckProtocol> make_cia402_truck(const DriveLayout& layout) {
    return std::make_unique<Cia402Truck>(layout);
}

}  // namespace hybrid_slam
