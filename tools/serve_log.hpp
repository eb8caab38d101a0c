// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "hybrid_slam/can/can_frame.hpp"
#include "hybrid_slam/core/trajectory.hpp"

namespace hybrid_slam::tools {

/// The files of a run that is served: truth.tum, bus.log and events.jsonl grow while it goes on,
/// so that what happened is known however it ends.
class ServeLog {
  public:
    /// Throws Error when the files cannot be made.
    explicit ServeLog(const std::filesystem::path& folder);

    /// Microseconds since 1970 at 0 s, as bus.log counts.
    void set_epoch(std::int64_t epoch) { epoch_ = epoch; }

    /// One line at once: {"t": now, "event": what, ...details}.
    void event(double now, const std::string& what, const nlohmann::ordered_json& details);
    void frame(double now, const CanFrame& frame);
    /// What has been added since the last call.
    void truth(const Trajectory& trajectory);
    /// Throws Error when the disk is full.
    void flush();

  private:
    void expect_written(const std::ofstream& stream, const char* name) const;

    std::filesystem::path folder_;
    std::int64_t epoch_ = 0;
    std::ofstream truth_;
    std::ofstream bus_;
    std::ofstream events_;
    std::size_t poses_ = 0;  ///< in truth.tum
};

}  // namespace hybrid_slam::tools
