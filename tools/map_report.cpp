// SPDX-License-Identifier: Apache-2.0
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "hybrid_slam/backend/map_folder.hpp"
#include "inspection_report.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

double duration_of(const Trajectory& trajectory) {
    const auto [first, last] =
        std::minmax_element(trajectory.begin(), trajectory.end(),
                            [](const auto& a, const auto& b) { return a.stamp < b.stamp; });
    return trajectory.empty() ? 0.0 : last->stamp - first->stamp;
}

/// When the file was last written, UTC.
std::string date_of(const std::filesystem::path& file) {
    struct stat info {};
    return ::stat(file.c_str(), &info) == 0
               ? fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(info.st_mtime))
               : "";
}

}  // namespace

MapReport::MapReport(const std::filesystem::path& folder) {
    const StoredMap map = read_map(folder);
    version = map.version;
    keyframes = map.keyframes.size();
    edges = map.graph.edges.size();
    closures = static_cast<std::size_t>(
        std::count_if(map.graph.edges.begin(), map.graph.edges.end(),
                      [](const Edge& edge) { return edge.kind == EdgeKind::kClosure; }));
    scans = map.trajectory.size();
    duration = duration_of(map.trajectory);
    path = length_of(map.trajectory);
    const GridGeometry& geometry = map.grid.geometry;
    resolution = geometry.resolution;
    width = geometry.width * resolution;
    height = geometry.height * resolution;
    free_area = static_cast<double>(
                    std::count(map.grid.states.begin(), map.grid.states.end(), CellState::kFree)) *
                resolution * resolution;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        if (entry.is_regular_file()) {
            ++files;
            megabytes += 1e-6 * static_cast<double>(entry.file_size());
        }
    }
    made = date_of(folder / "config.yaml");
}

std::string MapReport::text() const {
    return fmt::format(
        "map        version {}, whole: the checksums of all its files are right{}{}\n"
        "size       {:.1f} m x {:.1f} m in cells of {:g} cm; {:.1f} m2 are free\n"
        "drive      {} in {}, {:.1f} m\n"
        "graph      {}, {}, {}\n"
        "files      {}, {:.1f} MB",
        version, made.empty() ? "" : "; made ", made, width, height, 100.0 * resolution, free_area,
        counted(scans, "scan"), duration_text(duration), path, counted(keyframes, "keyframe"),
        counted(edges, "edge"), counted(closures, "loop closure"), counted(files, "file"),
        megabytes);
}

nlohmann::ordered_json MapReport::json() const {
    return {{"kind", "map"},
            {"version", version},
            {"checksums", "right"},
            {"made", made},
            {"width_m", rounded(width)},
            {"height_m", rounded(height)},
            {"resolution_m", rounded(resolution)},
            {"free_m2", rounded(free_area)},
            {"scans", scans},
            {"duration_s", rounded(duration)},
            {"path_length_m", rounded(path)},
            {"keyframes", keyframes},
            {"edges", edges},
            {"closures", closures},
            {"files", files},
            {"megabytes", rounded(megabytes)}};
}

}  // namespace hybrid_slam::tools
