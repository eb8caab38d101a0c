// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/live/lockstep_sensors.hpp"

#include <fmt/format.h>

#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/lidar/byte_source.hpp"
#include "hybrid_slam/lockstep/lockstep_client.hpp"

namespace hybrid_slam {
namespace {

constexpr double kPatience = 30.0;  // seconds; what is announced is on its line already

std::unique_ptr<Capture> camera_of(const RobotConfig& robot) {
    return robot.camera.enabled ? open_capture(robot.camera) : nullptr;
}

}  // namespace

struct LockstepSensors::State {
    State(const RobotConfig& robot_in, const std::string& url)
        : robot(robot_in),
          lidar(open_byte_source(robot.lidar)),
          camera(camera_of(robot)),
          clock(url) {}

    LidarBytes read_lidar(const LockstepArrival& announced);
    CameraFrame read_image(const LockstepArrival& announced) const;

    RobotConfig robot;
    std::unique_ptr<ByteSource> lidar;
    std::unique_ptr<Capture> camera;
    LockstepSensorClock clock;  // the last: what comes before the devices are open is lost
};

LidarBytes LockstepSensors::State::read_lidar(const LockstepArrival& announced) {
    LidarBytes read{announced.arrival, {}};
    const Stopwatch watch;
    std::vector<std::uint8_t> piece;
    while (read.bytes.size() < announced.bytes) {
        if (watch.seconds() > kPatience) {
            throw Error(fmt::format("{}: {} of {} bytes came", robot.lidar.port, read.bytes.size(),
                                    announced.bytes));
        }
        lidar->read(piece, 1.0);
        read.bytes.insert(read.bytes.end(), piece.begin(), piece.end());
    }
    if (read.bytes.size() > announced.bytes) {
        throw Error(fmt::format("{}: more bytes came than the clock said", robot.lidar.port));
    }
    return read;
}

CameraFrame LockstepSensors::State::read_image(const LockstepArrival& announced) const {
    CameraFrame frame;
    frame.arrival = announced.arrival;
    const Stopwatch watch;
    while (!camera->read(frame.image, 1.0)) {
        if (watch.seconds() > kPatience) {
            throw Error(robot.camera.device + ": the image that the clock said did not come");
        }
    }
    return frame;
}

LockstepSensors::LockstepSensors(const RobotConfig& robot, const std::string& url)
    : state_(std::make_unique<State>(robot, url)) {}
LockstepSensors::~LockstepSensors() = default;

std::optional<SensorEvent> LockstepSensors::next_within(double timeout) {
    std::optional<LockstepArrival> announced = state_->clock.next(timeout);
    while (announced && announced->what == LockstepArrival::What::kImage && !state_->camera) {
        state_->clock.done();  // a camera that nobody asked for
        announced = state_->clock.next(timeout);
    }
    if (!announced) {
        return std::nullopt;
    }
    SensorEvent event = announced->what == LockstepArrival::What::kLidar
                            ? SensorEvent(state_->read_lidar(*announced))
                            : SensorEvent(state_->read_image(*announced));
    state_->clock.done();
    return event;
}

std::optional<SensorEvent> LockstepSensors::next() {
    constexpr double kLong = 3600.0;  // seconds
    while (!ended()) {
        if (auto event = next_within(kLong)) {
            return event;
        }
    }
    return std::nullopt;
}

bool LockstepSensors::ended() const {
    return state_->clock.ended();
}

}  // namespace hybrid_slam
