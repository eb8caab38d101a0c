// SPDX-License-Identifier: Apache-2.0
#include "input.hpp"

#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/recording/recording.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

using Json = nlohmann::ordered_json;
using Kind = std::pair<std::uint64_t, const char*>;

std::vector<std::string> what_happened(std::initializer_list<Kind> kinds) {
    std::vector<std::string> warnings;
    for (const auto& [count, what] : kinds) {
        if (count > 0) {
            warnings.push_back(std::string(what) + ": " + with_commas(count));
        }
    }
    return warnings;
}

class LogInput : public Input {
  public:
    LogInput(const std::filesystem::path& file, const CarmenLogConfig& config)
        : log_(file, config) {}

    Source& source() override { return log_; }
    Json counts() const override { return to_json(log_.counts()); }
    std::vector<std::string> warnings() const override { return warnings_of(log_.counts()); }

  private:
    CarmenLog log_;
};

class RecordingInput : public Input {
  public:
    explicit RecordingInput(const std::filesystem::path& folder)
        : reader_(folder, false), source_(reader_, reader_.robot()) {}

    Source& source() override { return source_; }
    Json counts() const override {
        Json counts = to_json(source_.counts());
        counts["damaged_bytes"] = reader_.damaged_bytes();
        counts["torn_bytes"] = reader_.torn_bytes();
        return counts;
    }
    std::vector<std::string> warnings() const override {
        std::vector<std::string> warnings = warnings_of(source_.counts());
        for (std::string& warning : what_happened(
                 {{reader_.damaged_bytes(), "damaged bytes of the recording"},
                  {reader_.torn_bytes(), "bytes torn off at the end of the recording"}})) {
            warnings.push_back(std::move(warning));
        }
        return warnings;
    }

  private:
    RecordingReader reader_;
    SensorSource source_;
};

}  // namespace

std::unique_ptr<Input> open_input(const std::filesystem::path& path, const CarmenLogConfig& log) {
    if (std::filesystem::is_directory(path)) {
        if (!is_recording(path)) {
            throw Error(path.string() + ": is a folder, but no recording");
        }
        return std::make_unique<RecordingInput>(path);
    }
    return std::make_unique<LogInput>(path, log);
}

std::string name_of(const std::filesystem::path& path) {
    const std::filesystem::path tidy = path.lexically_normal();
    return (tidy.has_filename() ? tidy : tidy.parent_path()).filename().string();
}

std::vector<std::string> warnings_of(const CarmenLogCounts& counts) {
    return what_happened({{counts.malformed_lines, "unreadable lines"},
                          {counts.torn_last_line, "lines torn at the end"},
                          {counts.backward_stamps, "scans stamped earlier than the one before"},
                          {counts.duplicate_stamps, "scans stamped like the one before"},
                          {counts.bad_poses, "laser lines without usable poses"},
                          {counts.not_finite, "ranges that are no numbers"}});
}

std::vector<std::string> warnings_of(const SensorCounts& counts) {
    const LidarCounts& lidar = counts.lidar;
    return what_happened({{lidar.missed_scans, "scans missed"},
                          {lidar.repeated_scans, "scans repeated"},
                          {lidar.stream.bad_checksums, "telegrams with a wrong checksum"},
                          {lidar.stream.bad_contents, "telegrams that make no sense"},
                          {lidar.standby_scans, "scans in stand-by"},
                          {lidar.lockout_telegrams, "telegrams in lock-out"},
                          {lidar.counter_resets, "restarts of the scanner"},
                          {counts.bad_images, "unreadable images"}});
}

Json to_json(const CarmenLogCounts& counts) {
    return {{"lines", counts.lines},
            {"scans", counts.scans},
            {"odometry", counts.odometry},
            {"parameters", counts.parameters},
            {"beams", counts.beams},
            {"no_returns", counts.no_returns},
            {"not_finite", counts.not_finite},
            {"bad_poses", counts.bad_poses},
            {"backward_stamps", counts.backward_stamps},
            {"duplicate_stamps", counts.duplicate_stamps},
            {"malformed_lines", counts.malformed_lines},
            {"torn_last_line", counts.torn_last_line},
            {"ignored", counts.ignored}};
}

Json to_json(const SensorCounts& counts) {
    const LidarCounts& lidar = counts.lidar;
    const S300StreamCounts& stream = lidar.stream;
    return {{"scans", lidar.scans},
            {"beams", lidar.beams},
            {"no_returns", lidar.no_returns},
            {"missed_scans", lidar.missed_scans},
            {"repeated_scans", lidar.repeated_scans},
            {"standby_scans", lidar.standby_scans},
            {"lockout_telegrams", lidar.lockout_telegrams},
            {"without_distances", lidar.without_distances},
            {"other_fields", lidar.other_fields},
            {"other_devices", lidar.other_devices},
            {"counter_resets", lidar.counter_resets},
            {"protective_scans", lidar.protective_scans},
            {"warning_scans", lidar.warning_scans},
            {"stream",
             {{"bytes", stream.bytes},
              {"telegrams", stream.telegrams},
              {"garbage_bytes", stream.garbage_bytes},
              {"bad_checksums", stream.bad_checksums},
              {"bad_contents", stream.bad_contents}}},
            {"images", counts.images},
            {"bad_images", counts.bad_images}};
}

}  // namespace hybrid_slam::tools
