// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "can_open.hpp"
#include "curtis.hpp"
#include "little_endian.hpp"
#include "truck_protocol.hpp"
#include "wheel_motion.hpp"

namespace hybrid_slam {
namespace {

constexpr std::uint8_t kBatteryPercent = 80;

class CurtisTruck : public TruckProtocol {
  public:
    explicit CurtisTruck(const DriveLayout& layout) : layout_(layout) {}

    Answer receive(const CanFrame& frame) override {
        if (!can_open::is(frame, can_open::id(can_open::kRpdo1, layout_.node), 8)) {
            return {};
        }
        const std::uint8_t flags = frame.data[0];
        const bool forward = (flags & curtis::kForward) != 0;
        const bool reverse = (flags & curtis::kReverse) != 0;
        const double magnitude = std::min<double>(unsigned_at(frame, 1, 2), layout_.rpm_limit);
        command_.power = (flags & curtis::kInterlock) != 0;
        // Both directions at once are as good as none.
        command_.rpm = forward == reverse ? 0.0 : (forward ? magnitude : -magnitude);
        command_.steering = steering_from(layout_, i16_at(frame, 5) / 100.0);
        return {true, {}};
    }

    WheelCommand command() const override {
        WheelCommand command = command_;
        command.power = command.power && fault_ == 0;
        return command;
    }

    std::vector<CanFrame> feedback(double rpm, double steering) override {
        constexpr double kMost = 32767.0;
        CanFrame motor = CanFrame::of(can_open::id(can_open::kTpdo1, layout_.node),
                                      {0, 0, 0, 0, 0, kBatteryPercent, 0xFA, 0x00});
        put(motor, 0, std::lround(std::clamp(rpm, -kMost, kMost)), 2);
        motor.data[4] = fault_;
        CanFrame wheel =
            CanFrame::of(can_open::id(can_open::kTpdo3, layout_.node), {0, 0, 0, 0, 0, 0, 0, 0});
        put(wheel, 0, std::lround(100.0 * truck_degrees(layout_, steering)), 2);
        return {motor, wheel};
    }

    void set_fault(int code) override { fault_ = static_cast<std::uint8_t>(code); }

  private:
    DriveLayout layout_;
    WheelCommand command_;
    std::uint8_t fault_ = 0;
};

}  // namespace

std::unique_ptr<TruckProtocol> make_curtis_truck(const DriveLayout& layout) {
    return std::make_unique<CurtisTruck>(layout);
}

}  // namespace hybrid_slam
