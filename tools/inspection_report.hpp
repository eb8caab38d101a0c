// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "inspection.hpp"

namespace hybrid_slam::tools {

/// What `info` says of a recording: for people, and for programs.
std::string report_text(const Inspection& inspection, const Verdict& verdict);
nlohmann::ordered_json report_json(const Inspection& inspection, const Verdict& verdict);

/// What it says of a map. Throws Error for a map that is damaged or of a newer program.
struct MapReport {
    explicit MapReport(const std::filesystem::path& folder);

    std::string text() const;
    nlohmann::ordered_json json() const;

    int version = 0;
    std::size_t keyframes = 0;
    std::size_t edges = 0;
    std::size_t closures = 0;
    std::size_t scans = 0;
    double duration = 0.0;       ///< seconds driven, of all the drives
    double path = 0.0;           ///< metres driven, likewise
    double width = 0.0;          ///< metres, of the grid
    double height = 0.0;         ///< metres
    double resolution = 0.0;     ///< metres
    double free_area = 0.0;      ///< square metres known to be free
    double occupied_area = 0.0;  ///< likewise
    std::vector<std::pair<std::string, std::uintmax_t>> files;  ///< with their bytes, by name
    bool pyramid = false;  ///< has what searching the whole map needs ready
    std::string made;      ///< UTC, when its manifest was written
    std::string from;      ///< name of the drive; empty when its summary is not there
};

/// What it says of a map_server map. Throws Error as its reader does.
struct GridReport {
    explicit GridReport(const std::filesystem::path& yaml);

    std::string text() const;
    nlohmann::ordered_json json() const;

    double width = 0.0;       ///< metres
    double height = 0.0;      ///< metres
    double resolution = 0.0;  ///< metres
    double x = 0.0;           ///< metres, of the lower left corner in the map
    double y = 0.0;           ///< metres
    double yaw = 0.0;         ///< radians
    double free_area = 0.0;   ///< square metres
    double occupied_area = 0.0;
    double unknown_area = 0.0;
};

}  // namespace hybrid_slam::tools
