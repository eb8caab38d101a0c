// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <sstream>
#include <thread>
#include <vector>

#include "child.hpp"
#include "hybrid_slam/can/can_bus.hpp"
#include "hybrid_slam/can/drive_codec.hpp"
#include "hybrid_slam/sensors/robot.hpp"
#include "running.hpp"

namespace hybrid_slam::test {

/// `simulate --serve sim` as a process in a folder with the room, once all can be opened. A signal
/// or the end of its duration ends it.
class Serving {
  public:
    Serving(const TempFolder& folder, const std::string& arguments)
        : folder_(folder), child_(start(folder, arguments)) {
        const auto file = folder / "sim/endpoints.json";
        for (int i = 0; i < 3000 && !std::filesystem::exists(file); ++i) {
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        endpoints_ = Json::parse(bytes_of(file));
    }

    const Json& endpoints() const { return endpoints_; }

    RobotConfig robot() const {
        RobotConfig robot;
        robot.lidar.port = (folder_ / endpoints_["lidar"].get<std::string>()).string();
        robot.camera.enabled = endpoints_["camera"].is_string();
        if (robot.camera.enabled) {
            robot.camera.device = endpoints_["camera"];
        }
        return robot;
    }
    std::string can_port() const {
        const std::string link = endpoints_["can"].get<std::string>().substr(6);
        return "slcan:" + (folder_ / link).string();
    }
    std::unique_ptr<CanBus> open_bus() const {
        CanConfig config;
        config.port = can_port();
        return open_can_bus(config);
    }

    void end() const { child_.send(SIGTERM); }
    /// The exit code; once.
    int wait() const {
        const int status = child_.wait();
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }

    Json summary() const { return Json::parse(bytes_of(folder_ / "sim/summary.json")); }
    std::vector<Json> events(const std::string& what = {}) const {
        std::istringstream lines(bytes_of(folder_ / "sim/events.jsonl"));
        std::vector<Json> events;
        for (std::string line; std::getline(lines, line);) {
            events.push_back(Json::parse(line));
            if (!what.empty() && events.back()["event"] != what) {
                events.pop_back();
            }
        }
        return events;
    }

  private:
    static Child start(const TempFolder& folder, const std::string& arguments) {
        write_room(folder);
        return Child(folder, "simulate room.yaml --serve sim " + arguments);
    }

    const TempFolder& folder_;
    Child child_;
    Json endpoints_;
};

/// Frames of one command, as a drive sends them.
class Commands {
  public:
    explicit Commands(const DriveCommand& command)
        : command_(command), codec_(make_drive_codec({}, {})) {}

    /// How many frames the bus took.
    std::size_t send(CanBus& bus) {
        std::size_t sent = 0;
        for (const CanFrame& frame : codec_->encode(command_, true)) {
            sent += bus.send(frame) ? 1 : 0;
        }
        return sent;
    }
    DriveFeedback hear(const CanFrame& frame) {
        return codec_->decode(frame).value_or(DriveFeedback());
    }

  private:
    DriveCommand command_;
    std::unique_ptr<DriveCodec> codec_;
};

}  // namespace hybrid_slam::test
