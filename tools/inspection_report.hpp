// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

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
    double duration = 0.0;    ///< seconds
    double path = 0.0;        ///< metres driven
    double width = 0.0;       ///< metres, of the grid
    double height = 0.0;      ///< metres
    double resolution = 0.0;  ///< metres
    double free_area = 0.0;   ///< square metres known to be free
    std::size_t files = 0;
    double megabytes = 0.0;
    std::string made;  ///< UTC, when its configuration was written; empty when that is not there
};

}  // namespace hybrid_slam::tools
