// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "can_open.hpp"
#include "curtis.hpp"
#include "drive_codecs.hpp"
#include "little_endian.hpp"
#include "wheel_motion.hpp"

namespace hybrid_slam {
namespace {

class CurtisCodec : public DriveCodec {
  public:
    CurtisCodec(const DriveLayout& layout, const VehicleConfig& vehicle)
        : layout_(layout), vehicle_(vehicle) {
        feedback_.ready = true;
    }

    std::vector<CanFrame> start() const override {
        return layout_.start_nodes ? std::vector<CanFrame>{can_open::start_node(layout_.node)}
                                   : std::vector<CanFrame>{};
    }

    std::vector<CanFrame> encode(const DriveCommand& command, bool enabled) override {
        const DriveCommand wanted = within_limits(vehicle_, command);
        CanFrame frame =
            CanFrame::of(can_open::id(can_open::kRpdo1, layout_.node), {0, 0, 0, 0, 0, 0, 0, 0});
        if (!enabled) {
            return {frame};
        }
        const double signed_rpm =
            rpm_from_speed(layout_, wanted.speed, straighter(wanted.steering, feedback_.steering));
        const long rpm = std::lround(std::min(std::abs(signed_rpm), layout_.rpm_limit));
        const double centidegrees =
            std::clamp(100.0 * truck_degrees(layout_, wanted.steering), -curtis::kMostCentidegrees,
                       curtis::kMostCentidegrees);
        frame.data[0] = curtis::kInterlock;
        if (rpm > 0) {
            frame.data[0] |= signed_rpm > 0.0 ? curtis::kForward : curtis::kReverse;
        }
        put(frame, 1, rpm, 2);
        put(frame, 3, std::lround(10.0 * layout_.acceleration_time), 1);
        put(frame, 4, std::lround(10.0 * layout_.deceleration_time), 1);
        put(frame, 5, std::lround(centidegrees), 2);
        return {frame};
    }

    std::optional<DriveFeedback> decode(const CanFrame& frame) override {
        if (can_open::is(frame, can_open::id(can_open::kTpdo1, layout_.node), 6)) {
            rpm_ = i16_at(frame, 0);
            feedback_.drive_fault = frame.data[4];
            feedback_.battery = std::min(1.0, frame.data[5] / 100.0);
        } else if (can_open::is(frame, can_open::id(can_open::kTpdo3, layout_.node), 2)) {
            feedback_.steering = steering_from(layout_, i16_at(frame, 0) / 100.0);
            const auto fault = static_cast<std::size_t>(layout_.steering_fault_byte);
            feedback_.steering_fault = fault >= 2 && fault < frame.size ? frame.data[fault] : 0;
        } else {
            return std::nullopt;
        }
        if (rpm_ && (feedback_.steering || layout_.speed_of == SpeedOf::kAxle)) {
            feedback_.speed = speed_from_rpm(layout_, *rpm_, feedback_.steering.value_or(0.0));
        }
        return feedback_;
    }

  private:
    DriveLayout layout_;
    VehicleConfig vehicle_;
    DriveFeedback feedback_;
    std::optional<double> rpm_;
};

}  // namespace

std::unique_ptr<DriveCodec> make_curtis_codec(const DriveLayout& layout,
                                              const VehicleConfig& vehicle) {
    return std::make_unique<CurtisCodec>(layout, vehicle);
}

}  // namespace hybrid_slam
