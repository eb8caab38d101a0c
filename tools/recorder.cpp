// SPDX-License-Identifier: Apache-2.0
#include "recorder.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "hybrid_slam/core/error.hpp"
#include "input.hpp"
#include "interrupt.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr double kPatience = 0.1;    ///< seconds between two looks at signals
constexpr double kLookEvery = 0.25;  ///< seconds
constexpr double kRateOver = 3.0;    ///< seconds

double free_gigabytes(const std::filesystem::path& folder) {
    std::error_code error;
    const std::filesystem::space_info space = std::filesystem::space(folder, error);
    return error ? 0.0 : 1e-9 * static_cast<double>(space.available);
}

double rate_of(std::uint64_t count, double seconds) {
    return count > 1 && seconds > 0.0 ? static_cast<double>(count - 1) / seconds : 0.0;
}

RecordingDevices devices_of(const LiveStatus& status) {
    return {status.lidar.connects, status.lidar.dropped, status.camera.connects,
            status.camera.dropped};
}

std::uint64_t dropped_by_fullness(const RecordingCounts& counts) {
    return counts.dropped_images - counts.dropped_by_slowness;
}

}  // namespace

StatusLine::StatusLine(bool quiet) : visible_(!quiet && isatty(STDERR_FILENO) == 1) {}

void StatusLine::draw(const std::string& text) {
    if (visible_) {
        // ESC [ K clears the rest of the line. What cannot be shown is no error.
        std::fputs(fmt::format("\r{}\x1b[K", text).c_str(), stderr);
        std::fflush(stderr);
        drawn_ = true;
    }
}

void StatusLine::clear() {
    if (drawn_) {
        std::fputs("\r\x1b[K", stderr);
        std::fflush(stderr);
        drawn_ = false;
    }
}

void RateMeter::look(double now, std::size_t count) {
    looks_.emplace_back(now, count);
    while (looks_.size() > 2 && looks_.front().first < now - kRateOver) {
        looks_.pop_front();
    }
}

double RateMeter::rate() const {
    if (looks_.size() < 2) {
        return 0.0;
    }
    return static_cast<double>(looks_.back().second - looks_.front().second) /
           (looks_.back().first - looks_.front().first);
}

Recorder::Recorder(const std::filesystem::path& folder, const RobotConfig& robot, bool quiet)
    : folder_(folder),
      writer_(folder, robot),
      sensors_(robot),
      reader_(robot.lidar),
      line_(quiet),
      news_([this] { line_.clear(); }) {}

RecordingSummary Recorder::run(double most_seconds) {
    RecordingSummary summary;
    summary.folder = folder_;
    try {
        record(most_seconds);
        writer_.close(devices_of(sensors_.status()));
    } catch (const Error& error) {
        summary.failure = error.what();
    }
    line_.clear();
    sensors_.stop();
    summary.written = writer_.counts();
    summary.duration = summary.written.last_arrival - summary.written.first_arrival;
    summary.counts.lidar = reader_.counts();
    summary.counts.images = summary.written.images;
    summary.devices = sensors_.status();
    return summary;
}

void Recorder::record(double most_seconds) {
    while (!interrupted() && !sensors_.ended() &&
           (most_seconds <= 0.0 || clock_.seconds() < most_seconds)) {
        if (const std::optional<SensorEvent> event = sensors_.next_within(kPatience)) {
            take(*event);
        }
        if (clock_.seconds() >= next_look_) {
            look();
            next_look_ = clock_.seconds() + kLookEvery;
        }
    }
}

void Recorder::take(const SensorEvent& event) {
    writer_.push(event);
    if (const auto* bytes = std::get_if<LidarBytes>(&event)) {
        reader_.push(*bytes);
        while (reader_.next()) {  // only to be counted
        }
    }
}

void Recorder::look() {
    const double now = clock_.seconds();
    const RecordingCounts counts = writer_.counts();
    news_.look(sensors_.status());
    news_.look(reader_.counts(), now);
    news_.look_at_images(writer_.image_trouble(), now);
    scan_rate_.look(now, reader_.counts().scans);
    image_rate_.look(now, counts.images);
    if (line_.visible()) {
        line_.draw(status_text());
    }
}

std::string Recorder::status_text() const {
    const RecordingCounts counts = writer_.counts();
    const LiveStatus status = sensors_.status();
    std::string text = fmt::format("recording {}  {} {:.1f}/s", duration_text(clock_.seconds()),
                                   counted(reader_.counts().scans, "scan"), scan_rate_.rate());
    if (status.lidar.state != DeviceState::kStreaming) {
        text += fmt::format(" (lidar {})", to_string(status.lidar.state));
    }
    if (status.camera.state != DeviceState::kOff || counts.images > 0) {
        text += fmt::format("  {} {:.1f}/s", counted(counts.images, "image"), image_rate_.rate());
    }
    if (counts.dropped_images + status.camera.dropped > 0) {
        text +=
            fmt::format("  {} dropped", with_commas(counts.dropped_images + status.camera.dropped));
    }
    return text + fmt::format("  {:.1f} GB free", free_gigabytes(folder_));
}

std::string RecordingSummary::text() const {
    const LidarCounts& lidar = counts.lidar;
    std::string result = fmt::format("recording  {}, {:.1f} s{}\n", folder.string(), duration,
                                     failure.empty() ? "" : "; not closed");
    result += fmt::format("lidar      {}, {:.1f}/s, {}; {} missed, {}\n",
                          counted(lidar.scans, "scan"), rate_of(lidar.scans, duration),
                          megabytes(written.lidar_bytes), with_commas(lidar.missed_scans),
                          counted(lidar.stream.bad_checksums, "wrong checksum"));
    result += fmt::format("camera     {}, {:.1f}/s, {}", counted(written.images, "image"),
                          rate_of(written.images, duration), megabytes(written.image_bytes));
    const std::pair<std::uint64_t, const char*> losses[] = {
        {written.dropped_by_slowness, "images dropped because the disk was too slow"},
        {dropped_by_fullness(written), "images dropped because the disk was full or failed"},
        {devices.camera.dropped, "images dropped because this program was too slow"},
        {devices.lidar.dropped, "pieces of the lidar's bytes lost likewise"}};
    for (const auto& [count, what] : losses) {
        if (count > 0) {
            result += fmt::format("\nlost       {} {}", with_commas(count), what);
        }
    }
    return result;
}

nlohmann::ordered_json RecordingSummary::json() const {
    return {{"recording", folder.string()},
            {"closed", failure.empty()},
            {"failure", failure},
            {"duration_s", duration},
            {"scans", counts.lidar.scans},
            {"scan_rate_hz", rate_of(counts.lidar.scans, duration)},
            {"lidar_bytes", written.lidar_bytes},
            {"images", written.images},
            {"image_rate_hz", rate_of(written.images, duration)},
            {"image_bytes", written.image_bytes},
            {"dropped",
             {{"images_by_slow_disk", written.dropped_by_slowness},
              {"images_by_full_disk", dropped_by_fullness(written)},
              {"images_by_program", devices.camera.dropped},
              {"lidar_pieces_by_program", devices.lidar.dropped}}},
            {"connects", {{"lidar", devices.lidar.connects}, {"camera", devices.camera.connects}}},
            {"counts", to_json(counts)}};
}

}  // namespace hybrid_slam::tools
