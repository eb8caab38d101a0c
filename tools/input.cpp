// SPDX-License-Identifier: Apache-2.0
#include "input.hpp"

#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/recording/recording.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

using Json = nlohmann::ordered_json;

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
    RecordingInput(const std::filesystem::path& folder, const std::filesystem::path& robot,
                   bool images)
        : reader_(folder, images),
          robot_(robot.empty() ? reader_.robot() : read_robot(robot)),
          images_(images && robot_.camera.enabled),
          source_(reader_, robot_,
                  images_ ? SensorSource::Images::kGray : SensorSource::Images::kSkip) {}

    Source& source() override { return source_; }
    const CameraConfig* camera() const override { return images_ ? &robot_.camera : nullptr; }
    Json counts() const override {
        Json counts = to_json(source_.counts());
        counts["damaged_bytes"] = reader_.damaged_bytes();
        counts["torn_bytes"] = reader_.torn_bytes();
        return counts;
    }
    std::vector<std::string> warnings() const override {
        std::vector<Loss> losses = losses_of(source_.counts());
        losses.push_back({reader_.damaged_bytes(), "", "damaged bytes of the recording"});
        losses.push_back({reader_.torn_bytes(), "", "bytes torn off at the end of the recording"});
        return warnings_of(losses);
    }

  private:
    RecordingReader reader_;
    RobotConfig robot_;
    bool images_;
    SensorSource source_;
};

}  // namespace

std::unique_ptr<Input> open_input(const std::filesystem::path& path, const CarmenLogConfig& log,
                                  const std::filesystem::path& robot, bool images) {
    if (std::filesystem::is_directory(path)) {
        if (!is_recording(path)) {
            throw Error(path.string() + ": is a folder, but no recording");
        }
        return std::make_unique<RecordingInput>(path, robot, images);
    }
    if (!robot.empty()) {
        throw Error(path.string() + ": is a log, which --robot says nothing of");
    }
    return std::make_unique<LogInput>(path, log);
}

std::string name_of(const std::filesystem::path& path) {
    const std::filesystem::path tidy = path.lexically_normal();
    return (tidy.has_filename() ? tidy : tidy.parent_path()).filename().string();
}

std::vector<std::string> warnings_of(const std::vector<Loss>& losses) {
    std::vector<std::string> warnings;
    for (const Loss& loss : losses) {
        if (loss.count > 0 && !loss.harmless) {
            warnings.push_back(std::string(loss.words) + ": " + with_commas(loss.count));
        }
    }
    return warnings;
}

std::vector<std::string> warnings_of(const CarmenLogCounts& counts) {
    return warnings_of(
        std::vector<Loss>{{counts.malformed_lines, "", "unreadable lines"},
                          {counts.torn_last_line, "", "lines torn at the end"},
                          {counts.backward_stamps, "", "scans stamped earlier than the one before"},
                          {counts.duplicate_stamps, "", "scans stamped like the one before"},
                          {counts.bad_poses, "", "laser lines without usable poses"},
                          {counts.not_finite, "", "ranges that are no numbers"}});
}

std::vector<Loss> losses_of(const SensorCounts& counts) {
    const LidarCounts& lidar = counts.lidar;
    const S300StreamCounts& stream = lidar.stream;
    return {{lidar.missed_scans, "missed_scans", "scans missed"},
            {lidar.repeated_scans, "repeated_scans", "scans repeated"},
            {lidar.standby_scans, "standby_scans", "scans in stand-by"},
            {lidar.lockout_telegrams, "lockout_telegrams", "telegrams in lock-out"},
            {lidar.other_fields, "other_fields", "telegrams of another measuring field"},
            {lidar.other_devices, "other_devices", "telegrams of another scanner"},
            {lidar.without_distances, "without_distances", "telegrams without distances", true},
            {lidar.counter_resets, "counter_resets", "restarts of the scanner"},
            {lidar.clock_resets, "clock_resets", "new fits of the scanner's clock"},
            {stream.bad_checksums, "bad_checksums", "telegrams with a wrong checksum"},
            {stream.bad_contents, "bad_contents", "telegrams that make no sense"},
            {stream.overlapping, "overlapping", "telegrams within another one"},
            {stream.garbage_bytes, "garbage_bytes", "bytes of no telegram", true},
            {counts.bad_images, "bad_images", "unreadable images"}};
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
    Json json = {{"scans", lidar.scans},
                 {"beams", lidar.beams},
                 {"no_returns", lidar.no_returns},
                 {"protective_scans", lidar.protective_scans},
                 {"warning_scans", lidar.warning_scans},
                 {"images", counts.images},
                 {"telegrams", lidar.stream.telegrams},
                 {"bytes", lidar.stream.bytes}};
    for (const Loss& loss : losses_of(counts)) {
        json[loss.key] = loss.count;
    }
    return json;
}

}  // namespace hybrid_slam::tools
