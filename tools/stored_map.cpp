// SPDX-License-Identifier: Apache-2.0
#include "stored_map.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"
#include "hybrid_slam/recording/recording.hpp"

namespace hybrid_slam::tools {
namespace {

namespace fs = std::filesystem;

/// People mix up drives and maps.
void expect_no_drive(const fs::path& path) {
    const char* what = is_recording(path)          ? "a recording"
                       : fs::is_regular_file(path) ? "a file"
                                                   : nullptr;
    if (what != nullptr) {
        throw Error(fmt::format("{}: is {}, not a map; 'hybrid-slam map' makes a map of a drive",
                                path.string(), what));
    }
}

}  // namespace

StoredMap open_map_folder(const fs::path& path) {
    if (is_map_server_file(path)) {
        throw Error(path.string() +
                    ": this needs a map folder made by hybrid-slam; a map_server map serves "
                    "relocalize and localize only");
    }
    expect_no_drive(path);
    return read_map(path);
}

std::shared_ptr<const ReferenceMap> open_reference_map(const fs::path& path) {
    if (!is_map_server_file(path)) {
        expect_no_drive(path);
    }
    return read_reference_map(path);
}

std::string drive_of(const fs::path& map) {
    constexpr std::size_t kMostBytes = std::size_t{1} << 28U;
    const fs::path summary = map / MapExtras::kSummary;
    if (!fs::is_regular_file(summary)) {
        return "";
    }
    const auto json = nlohmann::json::parse(read_whole_file(summary, kMostBytes), nullptr, false);
    const bool told = json.is_object() && json.contains("log") && json["log"].is_string();
    return told ? json["log"].get<std::string>() : "";
}

}  // namespace hybrid_slam::tools
