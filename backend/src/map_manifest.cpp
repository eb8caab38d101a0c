// SPDX-License-Identifier: Apache-2.0
#include "map_manifest.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <limits>
#include <utility>

#include "hybrid_slam/backend/map_folder.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kFormat = "hybrid_slam map";
constexpr std::size_t kMostManifest = std::size_t{1} << 26U;

std::string crc_of(const std::string& bytes) {
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): zlib counts in unsigned bytes
    const auto* const data = reinterpret_cast<const Bytef*>(bytes.data());
    return fmt::format("{:08x}", crc32_z(0, data, bytes.size()));
}

json fingerprint_of(const fs::path& place) {
    const std::string bytes = read_whole_file(place, std::numeric_limits<std::size_t>::max());
    return {{"bytes", bytes.size()}, {"crc32", crc_of(bytes)}};
}

/// Pictures are for people: whoever deletes one or draws it anew has not touched the map.
bool is_picture(const fs::path& name) {
    return name.extension() == ".png";
}

json fingerprints_in(const fs::path& folder) {
    json files = json::object();
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        const std::string name = entry.path().lexically_relative(folder).generic_string();
        if (entry.is_regular_file() && name != kManifestName) {
            files[name] = is_picture(name) ? json::object() : fingerprint_of(entry.path());
        }
    }
    return files;
}

/// Null when it is no JSON, or that of someone else.
json parse_manifest(const std::string& text) {
    json manifest = json::parse(text, nullptr, false);
    const bool ours =
        manifest.is_object() && manifest.contains("format") && manifest["format"] == json(kFormat);
    return ours ? std::move(manifest) : json();
}

void check_file(const fs::path& folder, const std::string& name, const json& expected) {
    const fs::path manifest = folder / kManifestName;
    const fs::path place = folder / name;
    const fs::path plain = fs::path(name).lexically_normal();
    if (plain.is_absolute() || plain.empty() || *plain.begin() == "..") {
        fail_damaged(manifest, fmt::format("'{}' is not in the folder", name));
    }
    if (is_picture(plain)) {
        return;
    }
    if (!fs::is_regular_file(place)) {
        throw Error(place.string() + ": is missing from the map");
    }
    const std::uint64_t bytes = count_of(manifest, expected, "bytes");
    if (const std::uintmax_t size = fs::file_size(place); size != bytes) {
        fail_damaged(place, fmt::format("{} bytes instead of {}", size, bytes));
    }
    if (fingerprint_of(place) != expected) {
        fail_damaged(place, "its CRC-32 does not fit");
    }
}

}  // namespace

[[noreturn]] void fail_damaged(const fs::path& place, const std::string& why) {
    throw Error(place.string() + ": damaged: " + why);
}

const json& member(const fs::path& place, const json& object, const char* key) {
    if (!object.is_object() || !object.contains(key)) {
        fail_damaged(place, fmt::format("'{}' is missing", key));
    }
    return object[key];
}

std::uint64_t count_of(const fs::path& place, const json& object, const char* key) {
    const json& value = member(place, object, key);
    if (!value.is_number_unsigned()) {
        fail_damaged(place, fmt::format("'{}' is no count", key));
    }
    return value.get<std::uint64_t>();
}

json manifest_in(const fs::path& folder) {
    const fs::path place = folder / kManifestName;
    return fs::is_regular_file(place) ? parse_manifest(read_whole_file(place, kMostManifest))
                                      : json();
}

json read_map_manifest(const fs::path& folder) {
    const fs::path place = folder / kManifestName;
    if (!fs::is_directory(folder)) {
        throw Error(folder.string() + ": there is no such folder");
    }
    if (!fs::exists(place)) {
        throw Error(
            fmt::format("{}: is no map folder, it has no {}", folder.string(), kManifestName));
    }
    json manifest = parse_manifest(read_whole_file(place, kMostManifest));
    if (manifest.is_null()) {
        throw Error(place.string() + ": damaged, or of another program");
    }
    const std::uint64_t version = count_of(place, manifest, "version");
    if (version > kMapFormatVersion) {
        throw Error(fmt::format("{}: the map has version {}, but this program reads maps up to {}",
                                folder.string(), version, kMapFormatVersion));
    }
    const json crc = member(place, manifest, "crc32");
    manifest.erase("crc32");
    if (version < 1 || crc != json(crc_of(manifest.dump()))) {
        fail_damaged(place, "its CRC-32 does not fit");
    }
    return manifest;
}

void check_files(const fs::path& folder, const json& manifest) {
    const json& files = member(folder / kManifestName, manifest, "files");
    for (const char* name :
         {"keyframes.bin", "graph.g2o", "trajectory.tum", "map.yaml", "map.pgm"}) {
        member(folder / kManifestName, files, name);
    }
    for (const auto& [name, expected] : files.items()) {
        check_file(folder, name, expected);
    }
}

void write_manifest(const fs::path& folder, json facts) {
    facts["format"] = kFormat;
    facts["version"] = kMapFormatVersion;
    try {
        facts["files"] = fingerprints_in(folder);
    } catch (const fs::filesystem_error& error) {
        throw Error(folder.string() + ": " + error.code().message());
    }
    facts.erase("crc32");
    try {
        facts["crc32"] = crc_of(facts.dump());
    } catch (const json::exception&) {
        throw Error(folder.string() + ": the name of a file in it is not UTF-8");
    }
    TextFileWriter writer(folder / kManifestName);
    writer.write(facts.dump(2) + "\n");
    writer.close();
}

}  // namespace hybrid_slam
