// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "hybrid_slam/core/source.hpp"
#include "hybrid_slam/logs/carmen_log.hpp"
#include "hybrid_slam/sensors/sensor_source.hpp"

namespace hybrid_slam::tools {

/// What a session reads: a log, a recording, live sensors.
class Input {
  public:
    Input() = default;
    Input(const Input&) = delete;
    Input& operator=(const Input&) = delete;
    virtual ~Input() = default;

    virtual Source& source() = 0;
    /// Whose images the source yields; nullptr when it yields none.
    virtual const CameraConfig* camera() const { return nullptr; }
    /// Whether the measurements are taken now, so that nothing may wait.
    virtual bool live() const { return false; }
    /// Of a live one: seconds of the clock that arrivals are of.
    virtual double now() const { return 0.0; }
    /// What was read so far, and what had to be left out.
    virtual nlohmann::ordered_json counts() const = 0;
    /// What was not as it should be: "kind: count" each.
    virtual std::vector<std::string> warnings() const = 0;
};

/// Opens the folder of a recording or a CARMEN log. `robot`, a file, is taken in place of the one
/// that was recorded; a log has none. Images are decoded when they are asked for and the robot's
/// camera is enabled. Throws Error that names the file.
std::unique_ptr<Input> open_input(const std::filesystem::path& path, const CarmenLogConfig& log,
                                  const std::filesystem::path& robot, bool images);

/// The last part of a path that has one: "drive1" of "drives/drive1/".
std::string name_of(const std::filesystem::path& path);

/// One kind of what was lost or not as it should be.
struct Loss {
    std::uint64_t count = 0;
    const char* key = "";    ///< in JSON
    const char* words = "";  ///< for people
    /// A live stream always begins with some: told by `info`, no warning.
    bool harmless = false;
};

/// All kinds, those that did not happen too.
std::vector<Loss> losses_of(const SensorCounts& counts);

/// What is to be warned of: "words: count" each.
std::vector<std::string> warnings_of(const std::vector<Loss>& losses);
std::vector<std::string> warnings_of(const CarmenLogCounts& counts);
nlohmann::ordered_json to_json(const CarmenLogCounts& counts);
nlohmann::ordered_json to_json(const SensorCounts& counts);

}  // namespace hybrid_slam::tools
