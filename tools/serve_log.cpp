// SPDX-License-Identifier: Apache-2.0
#include "serve_log.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "hybrid_slam/can/candump.hpp"
#include "hybrid_slam/core/error.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {

ServeLog::ServeLog(const std::filesystem::path& folder)
    : folder_(folder),
      truth_(folder / "truth.tum"),
      bus_(folder / "bus.log"),
      events_(folder / "events.jsonl") {
    flush();
}

void ServeLog::event(double now, const std::string& what, const nlohmann::ordered_json& details) {
    nlohmann::ordered_json line = {{"t", rounded(now)}, {"event", what}};
    line.update(details);
    events_ << line.dump() << std::endl;
}

void ServeLog::frame(double now, const CanFrame& frame) {
    CandumpLine line;
    line.microseconds = epoch_ + std::llround(1e6 * now);
    line.frame = frame;
    bus_ << to_candump(line) << '\n';
}

/// As write_tum does it.
void ServeLog::truth(const Trajectory& trajectory) {
    for (; poses_ < trajectory.size(); ++poses_) {
        const auto& [stamp, pose] = trajectory[poses_];
        truth_ << fmt::format("{:.6f} {:.9f} {:.9f} 0 0 0 {:.12f} {:.12f}\n", stamp, pose.x(),
                              pose.y(), std::sin(0.5 * pose.heading), std::cos(0.5 * pose.heading));
    }
}

void ServeLog::flush() {
    truth_.flush();
    bus_.flush();
    events_.flush();
    expect_written(truth_, "truth.tum");
    expect_written(bus_, "bus.log");
    expect_written(events_, "events.jsonl");
}

void ServeLog::expect_written(const std::ofstream& stream, const char* name) const {
    if (!stream) {
        throw Error((folder_ / name).string() + ": cannot be written");
    }
}

}  // namespace hybrid_slam::tools
