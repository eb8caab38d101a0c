// SPDX-License-Identifier: Apache-2.0
#include "live_input.hpp"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "hybrid_slam/live/lockstep_sensors.hpp"
#include "interrupt.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr double kPatience = 0.2;  ///< seconds between two looks at signals and statuses

/// So that a message does not run on behind the progress bar.
void clear_line() {
    if (isatty(STDERR_FILENO) == 1) {
        std::fputs("\r\x1b[K", stderr);  // ESC [ K clears the rest of the line
    }
}

class LiveInput : public Input {
  public:
    LiveInput(const RobotConfig& robot, bool images, const LiveOptions& options)
        : robot_(robot),
          images_(images && robot.camera.enabled),
          stream_(robot, options),
          source_(stream_, robot,
                  images_ ? SensorSource::Images::kGray : SensorSource::Images::kSkip) {
        stream_.watch(source_);
    }

    Source& source() override { return source_; }
    const CameraConfig* camera() const override { return images_ ? &robot_.camera : nullptr; }
    bool live() const override { return true; }
    double now() const override { return stream_.now(); }
    nlohmann::ordered_json counts() const override {
        nlohmann::ordered_json counts = to_json(source_.counts());
        const LiveStatus status = stream_.status();
        counts["lidar"] = {{"connects", status.lidar.connects}, {"dropped", status.lidar.dropped}};
        counts["camera"] = {{"connects", status.camera.connects},
                            {"dropped", status.camera.dropped}};
        return counts;
    }
    std::vector<std::string> warnings() const override {
        std::vector<Loss> losses = losses_of(source_.counts());
        const LiveStatus status = stream_.status();
        losses.push_back(
            {status.lidar.dropped, "", "pieces of the lidar's bytes dropped: mapping is too slow"});
        losses.push_back({status.camera.dropped, "", "images dropped: mapping is too slow"});
        return warnings_of(losses);
    }

  private:
    RobotConfig robot_;
    bool images_;
    LiveStream stream_;
    SensorSource source_;
};

/// The devices of a simulator that waits for everyone, until a signal comes.
class LockstepStream : public SensorStream {
  public:
    LockstepStream(const RobotConfig& robot, const std::string& clock) : sensors_(robot, clock) {}

    std::optional<SensorEvent> next() override {
        while (!interrupted() && !sensors_.ended()) {
            if (std::optional<SensorEvent> event = sensors_.next_within(kPatience)) {
                now_ = arrival_of(*event);
                return event;
            }
        }
        return std::nullopt;
    }
    double now() const { return now_; }

  private:
    LockstepSensors sensors_;
    double now_ = 0.0;
};

class LockstepInput : public Input {
  public:
    LockstepInput(const RobotConfig& robot, bool images, const std::string& clock)
        : robot_(robot),
          stream_(robot, clock),
          source_(stream_, robot,
                  images ? SensorSource::Images::kGray : SensorSource::Images::kSkip),
          images_(images) {}

    Source& source() override { return source_; }
    const CameraConfig* camera() const override { return images_ ? &robot_.camera : nullptr; }
    bool live() const override { return true; }
    double now() const override { return stream_.now(); }
    nlohmann::ordered_json counts() const override { return to_json(source_.counts()); }
    std::vector<std::string> warnings() const override {
        return warnings_of(losses_of(source_.counts()));
    }

  private:
    RobotConfig robot_;
    LockstepStream stream_;
    SensorSource source_;
    bool images_;
};

}  // namespace

void add_clock_option(CLI::App& command, std::string& clock) {
    command
        .add_option("--clock", clock,
                    "Clock of 'simulate --serve --lockstep': time goes on when all have computed")
        ->type_name("tcp://HOST:PORT");
}

void add_robot_options(CLI::App& command, RobotOptions& options) {
    command
        .add_option(
            "--robot", options.robot,
            "Robot (YAML), see config/robots; without it the recorded one or, live, a forklift")
        ->type_name("FILE");
    command
        .add_option(
            "--lidar", options.lidar,
            "Port of the lidar: /dev/ttyUSB0, tcp://host:port or a file (robot's lidar.port)")
        ->type_name("PORT");
    command
        .add_option("--camera", options.camera,
                    "/dev/video0, a video or a folder of images (robot's camera.device)")
        ->type_name("DEVICE");
    command.add_flag("--no-camera", options.no_camera, "The lidar alone");
}

RobotConfig robot_of(const RobotOptions& options) {
    RobotConfig robot = options.robot.empty() ? RobotConfig() : read_robot(options.robot);
    if (!options.lidar.empty()) {
        robot.lidar.port = options.lidar;
    }
    if (!options.camera.empty()) {
        robot.camera.device = options.camera;
        robot.camera.enabled = true;
    }
    robot.camera.enabled = robot.camera.enabled && !options.no_camera;
    return robot;
}

LiveStream::LiveStream(const RobotConfig& robot, const LiveOptions& options)
    : sensors_(robot, options), news_(clear_line) {}

std::optional<SensorEvent> LiveStream::next() {
    while (!interrupted() && !sensors_.ended()) {
        std::optional<SensorEvent> event = sensors_.next_within(kPatience);
        news_.look(sensors_.status());
        if (source_ != nullptr) {
            news_.look(source_->counts().lidar, clock_.seconds());
        }
        if (event) {
            return event;
        }
    }
    return std::nullopt;
}

std::unique_ptr<Input> open_live_input(const RobotConfig& robot, bool images,
                                       const LiveInputOptions& options) {
    if (!options.clock.empty()) {
        RobotConfig used = robot;
        used.camera.enabled = robot.camera.enabled && images;
        return std::make_unique<LockstepInput>(used, used.camera.enabled, options.clock);
    }
    constexpr std::size_t kPromptImages = 3;  // a tenth of a second of them
    LiveOptions live;
    live.most_images = options.prompt ? kPromptImages : live.most_images;
    return std::make_unique<LiveInput>(robot, images, live);
}

}  // namespace hybrid_slam::tools
