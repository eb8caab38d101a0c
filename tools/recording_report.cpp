// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "input.hpp"
#include "inspection_report.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostGapsListed = 100;

std::string gaps_text(const Cadence& cadence) {
    if (cadence.gaps.empty()) {
        return "no gap";
    }
    const Gap longest = cadence.longest_gap();
    return fmt::format("{}, the longest {:.2f} s, {:.1f} s after the start",
                       counted(cadence.gaps.size(), "gap"), longest.seconds, longest.after);
}

std::string mounting_text(const RobotConfig& robot) {
    const LidarConfig& lidar = robot.lidar;
    std::string text =
        fmt::format("{}; lidar at x {:.2f} y {:.2f} m, turned {:.1f} deg{}", robot.name, lidar.x,
                    lidar.y, degrees(lidar.yaw), lidar.upside_down ? ", upside down" : "");
    if (robot.camera.enabled) {
        const CameraMounting& mounting = robot.camera.mounting;
        text += fmt::format(
            "; camera at x {:.2f} y {:.2f} z {:.2f} m, turned {:.1f} deg, "
            "{:.1f} deg down",
            mounting.x, mounting.y, mounting.z, degrees(mounting.yaw), degrees(mounting.pitch));
    }
    return text;
}

std::string losses_text(const Inspection& inspection) {
    std::vector<Loss> losses = losses_of(inspection.counts);
    losses.push_back({inspection.damaged_bytes, "", "damaged bytes"});
    losses.push_back({inspection.torn_bytes, "", "bytes torn off at the end"});
    std::string text;
    for (const Loss& loss : losses) {
        if (loss.count > 0) {
            text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", loss.words,
                                with_commas(loss.count));
        }
    }
    return text.empty() ? "none" : text;
}

std::string images_text(const Inspection& inspection) {
    const Cadence& images = inspection.images;
    if (images.count == 0) {
        return "none";
    }
    return fmt::format("{}, {:.1f} Hz, {} x {} pixels, {}; {}", counted(images.count, "image"),
                       images.rate(), inspection.image_width, inspection.image_height,
                       megabytes(inspection.image_bytes), gaps_text(images));
}

Json cadence_json(const Cadence& cadence) {
    Json gaps = Json::array();
    for (std::size_t i = 0; i < std::min(cadence.gaps.size(), kMostGapsListed); ++i) {
        gaps.push_back({{"after_s", rounded(cadence.gaps[i].after)},
                        {"seconds", rounded(cadence.gaps[i].seconds)}});
    }
    return {{"count", cadence.count},
            {"rate_hz", rounded(cadence.rate())},
            {"first_s", rounded(cadence.first)},
            {"last_s", rounded(cadence.last)},
            {"gap_count", cadence.gaps.size()},
            {"longest_gap_s", rounded(cadence.longest_gap().seconds)},
            {"gaps", std::move(gaps)}};
}

Json mounting_json(const RobotConfig& robot) {
    const LidarConfig& lidar = robot.lidar;
    const CameraMounting& camera = robot.camera.mounting;
    Json json = {{"name", robot.name},
                 {"lidar",
                  {{"x_m", lidar.x},
                   {"y_m", lidar.y},
                   {"yaw_deg", rounded(degrees(lidar.yaw))},
                   {"upside_down", lidar.upside_down}}}};
    if (robot.camera.enabled) {
        json["camera"] = {{"x_m", camera.x},
                          {"y_m", camera.y},
                          {"z_m", camera.z},
                          {"yaw_deg", rounded(degrees(camera.yaw))},
                          {"pitch_deg", rounded(degrees(camera.pitch))},
                          {"roll_deg", rounded(degrees(camera.roll))}};
    }
    return json;
}

}  // namespace

std::string report_text(const Inspection& inspection, const Verdict& verdict) {
    const RecordingManifest& manifest = inspection.manifest;
    const Cadence& scans = inspection.scans;
    std::string text = fmt::format("recording  {}{}{}, {:.1f} s{}\n",
                                   manifest.origin.empty() ? "unknown" : manifest.origin,
                                   manifest.created.empty() ? "" : ", ", manifest.created,
                                   inspection.duration, manifest.closed ? "" : "; never closed");
    text += "robot      " + mounting_text(inspection.robot) + "\n";
    text += fmt::format("lidar      {}, {:.1f} Hz, {}; {}\n", counted(scans.count, "scan"),
                        scans.rate(), megabytes(inspection.lidar_bytes), gaps_text(scans));
    text +=
        fmt::format("returns    {:.0f} % of {} beams, {:.0f} % in the median scan\n",
                    100.0 * inspection.share_of_returns(),
                    with_commas(inspection.counts.lidar.beams), 100.0 * inspection.typical_returns);
    text += "losses     " + losses_text(inspection) + "\n";
    text += "camera     " + images_text(inspection) + "\n";
    text += fmt::format("motion     {} (up to {:.0f} % of the beams ended elsewhere)\n",
                        inspection.moved() ? "the vehicle moved" : "the vehicle never moved",
                        100.0 * inspection.most_changed);
    for (const std::string& warning : verdict.warnings) {
        text += "warning    " + warning + "\n";
    }
    return text + (verdict.fit()
                       ? "verdict    fit for mapping"
                       : fmt::format("verdict    not fit: {}", fmt::join(verdict.obstacles, "; ")));
}

Json report_json(const Inspection& inspection, const Verdict& verdict) {
    const RecordingManifest& manifest = inspection.manifest;
    Json json = {{"kind", "recording"},
                 {"version", manifest.version},
                 {"origin", manifest.origin},
                 {"created", manifest.created},
                 {"closed", manifest.closed},
                 {"duration_s", rounded(inspection.duration)},
                 {"robot", mounting_json(inspection.robot)},
                 {"scans", cadence_json(inspection.scans)},
                 {"images", cadence_json(inspection.images)}};
    json["images"]["bytes"] = inspection.image_bytes;
    json["images"]["width"] = inspection.image_width;
    json["images"]["height"] = inspection.image_height;
    if (manifest.counts) {
        json["images"]["dropped"] = manifest.counts->dropped_images;
        json["images"]["dropped_by_slowness"] = manifest.counts->dropped_by_slowness;
    }
    json["lidar_bytes"] = inspection.lidar_bytes;
    json["damaged_bytes"] = inspection.damaged_bytes;
    json["torn_bytes"] = inspection.torn_bytes;
    json["counts"] = to_json(inspection.counts);
    json["share_of_returns"] = rounded(inspection.share_of_returns());
    json["share_of_returns_median"] = rounded(inspection.typical_returns);
    json["share_missed"] = rounded(inspection.share_missed());
    json["moved"] = inspection.moved();
    json["most_changed"] = rounded(inspection.most_changed);
    json["fit"] = verdict.fit();
    json["obstacles"] = verdict.obstacles;
    json["warnings"] = verdict.warnings;
    return json;
}

}  // namespace hybrid_slam::tools
