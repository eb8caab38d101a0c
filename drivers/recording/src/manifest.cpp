// SPDX-License-Identifier: Apache-2.0
#include "manifest.hpp"

#include <cstdint>
#include <ctime>
#include <nlohmann/json.hpp>
#include <system_error>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam {

namespace {

using Json = nlohmann::ordered_json;

constexpr auto kFormat = "hybrid_slam recording";
constexpr std::size_t kMostManifest = std::size_t{1} << 20U;

Json counts_json(const RecordingCounts& counts) {
    return {{"lidar_chunks", counts.lidar_chunks},
            {"lidar_bytes", counts.lidar_bytes},
            {"images", counts.images},
            {"image_bytes", counts.image_bytes},
            {"dropped_images", counts.dropped_images},
            {"dropped_by_slowness", counts.dropped_by_slowness},
            {"first_arrival", counts.first_arrival},
            {"last_arrival", counts.last_arrival}};
}

Json devices_json(const RecordingDevices& devices) {
    return {{"lidar_connects", devices.lidar_connects},
            {"lidar_dropped", devices.lidar_dropped},
            {"camera_connects", devices.camera_connects},
            {"camera_dropped", devices.camera_dropped}};
}

/// Leaves the value alone where the manifest has none of its kind.
void take(const Json& object, const char* key, std::uint64_t& value) {
    const auto found = object.find(key);
    value =
        found != object.end() && found->is_number_unsigned() ? found->get<std::uint64_t>() : value;
}
void take(const Json& object, const char* key, double& value) {
    const auto found = object.find(key);
    value = found != object.end() && found->is_number() ? found->get<double>() : value;
}
void take(const Json& object, const char* key, std::string& value) {
    const auto found = object.find(key);
    value = found != object.end() && found->is_string() ? found->get<std::string>() : value;
}

RecordingCounts counts_of(const Json& object) {
    RecordingCounts counts;
    take(object, "lidar_chunks", counts.lidar_chunks);
    take(object, "lidar_bytes", counts.lidar_bytes);
    take(object, "images", counts.images);
    take(object, "image_bytes", counts.image_bytes);
    take(object, "dropped_images", counts.dropped_images);
    take(object, "dropped_by_slowness", counts.dropped_by_slowness);
    take(object, "first_arrival", counts.first_arrival);
    take(object, "last_arrival", counts.last_arrival);
    return counts;
}

RecordingDevices devices_of(const Json& object) {
    RecordingDevices devices;
    take(object, "lidar_connects", devices.lidar_connects);
    take(object, "lidar_dropped", devices.lidar_dropped);
    take(object, "camera_connects", devices.camera_connects);
    take(object, "camera_dropped", devices.camera_dropped);
    return devices;
}

Json parsed(const std::filesystem::path& file) {
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored)) {
        return {};
    }
    return Json::parse(read_whole_file(file, kMostManifest), nullptr, false);
}

bool is_ours(const Json& manifest) {
    return manifest.is_object() && manifest.value("format", Json()) == Json(kFormat);
}

}  // namespace

std::string to_text(const RecordingManifest& manifest) {
    Json json = {{"format", kFormat}, {"version", manifest.version}, {"origin", manifest.origin}};
    if (!manifest.created.empty()) {
        json["created"] = manifest.created;
    }
    json["files"] = {{"robot", RecordingFiles::kRobot}, {"lidar", RecordingFiles::kLidar}};
    if (!manifest.counts || manifest.counts->images > 0) {
        json["files"]["camera"] = RecordingFiles::kCamera;
    }
    json["closed"] = manifest.closed;
    if (manifest.counts) {
        json["counts"] = counts_json(*manifest.counts);
    }
    if (manifest.devices) {
        json["devices"] = devices_json(*manifest.devices);
    }
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

RecordingManifest read_manifest(const std::filesystem::path& folder) {
    const std::filesystem::path file = folder / RecordingFiles::kManifest;
    const Json json = parsed(file);
    RecordingManifest manifest;
    if (!json.is_object()) {
        return manifest;
    }
    if (!is_ours(json)) {
        throw Error(file.string() + ": is not that of a recording");
    }
    std::uint64_t version = kRecordingVersion;
    take(json, "version", version);
    if (version > kRecordingVersion) {
        throw Error(folder.string() + ": the recording has version " + std::to_string(version) +
                    ", but this program reads recordings up to version " +
                    std::to_string(kRecordingVersion));
    }
    manifest.version = static_cast<int>(version);
    take(json, "origin", manifest.origin);
    take(json, "created", manifest.created);
    const auto closed = json.find("closed");
    manifest.closed = closed != json.end() && *closed == Json(true);
    if (const auto counts = json.find("counts"); counts != json.end() && counts->is_object()) {
        manifest.counts = counts_of(*counts);
    }
    if (const auto found = json.find("devices"); found != json.end() && found->is_object()) {
        manifest.devices = devices_of(*found);
    }
    return manifest;
}

bool is_recording(const std::filesystem::path& folder) {
    std::error_code ignored;
    try {
        return std::filesystem::is_regular_file(folder / RecordingFiles::kLidar, ignored) ||
               is_ours(parsed(folder / RecordingFiles::kManifest));
    } catch (const Error&) {
        return false;
    }
}

std::string utc_now() {
    const std::time_t now = std::time(nullptr);
    std::tm parts{};
    char text[32] = {};
    gmtime_r(&now, &parts);
    std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
    return text;
}

}  // namespace hybrid_slam
