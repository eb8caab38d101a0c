// SPDX-License-Identifier: Apache-2.0
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "hybrid_slam/backend/map_folder.hpp"
#include "inspection_report.hpp"
#include "messages.hpp"
#include "stored_map.hpp"

namespace hybrid_slam::tools {
namespace {

double duration_of(const Trajectory& trajectory) {
    const auto [first, last] =
        std::minmax_element(trajectory.begin(), trajectory.end(),
                            [](const auto& a, const auto& b) { return a.stamp < b.stamp; });
    return trajectory.empty() ? 0.0 : last->stamp - first->stamp;
}

/// A map of several drives, or a cropped one, holds pieces of ways: from one to the next nobody
/// drove. Logs have short steps back in time, which are none.
std::vector<Trajectory> pieces_of(const Trajectory& trajectory) {
    constexpr double kPause = 5.0;  // seconds
    std::vector<Trajectory> pieces;
    for (const StampedPose& pose : trajectory) {
        if (pieces.empty() || std::abs(pose.stamp - pieces.back().back().stamp) > kPause) {
            pieces.emplace_back();
        }
        pieces.back().push_back(pose);
    }
    return pieces;
}

/// When the file was last written, UTC.
std::string date_of(const std::filesystem::path& file) {
    struct stat info {};
    return ::stat(file.c_str(), &info) == 0
               ? fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(info.st_mtime))
               : "";
}

/// Square metres of the cells in a state.
double area_of(const StateGrid& grid, CellState state) {
    return static_cast<double>(std::count(grid.states.begin(), grid.states.end(), state)) *
           grid.geometry.resolution * grid.geometry.resolution;
}

std::string size_text(std::uintmax_t bytes) {
    return bytes < 1000      ? fmt::format("{} B", bytes)
           : bytes < 1000000 ? fmt::format("{:.1f} kB", 1e-3 * static_cast<double>(bytes))
                             : megabytes(bytes);
}

std::uintmax_t total_of(const std::vector<std::pair<std::string, std::uintmax_t>>& files) {
    std::uintmax_t total = 0;
    for (const auto& [name, bytes] : files) {
        total += bytes;
    }
    return total;
}

}  // namespace

MapReport::MapReport(const std::filesystem::path& folder) {
    const StoredMap map = open_map_folder(folder);
    version = map.version;
    keyframes = map.keyframes.size();
    edges = map.graph.edges.size();
    closures = static_cast<std::size_t>(
        std::count_if(map.graph.edges.begin(), map.graph.edges.end(),
                      [](const Edge& edge) { return edge.kind == EdgeKind::kClosure; }));
    scans = map.trajectory.size();
    for (const Trajectory& piece : pieces_of(map.trajectory)) {
        duration += duration_of(piece);
        path += length_of(piece);
    }
    const GridGeometry& geometry = map.grid.geometry;
    resolution = geometry.resolution;
    width = geometry.width * resolution;
    height = geometry.height * resolution;
    free_area = area_of(map.grid, CellState::kFree);
    occupied_area = area_of(map.grid, CellState::kOccupied);
    pyramid = map.pyramid.has_value();
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        if (entry.is_regular_file()) {
            files.emplace_back(entry.path().lexically_relative(folder).string(), entry.file_size());
        }
    }
    std::sort(files.begin(), files.end());
    from = drive_of(folder);
    made = date_of(folder / "manifest.json");
}

std::string MapReport::text() const {
    std::string text = fmt::format(
        "map        version {}, whole: the checksums of its data are right{}{}{}{}\n"
        "size       {:.1f} m x {:.1f} m in cells of {:g} cm; {:.1f} m2 are free, {:.1f} m2 "
        "occupied\n"
        "drive      {} in {}, {:.1f} m\n"
        "graph      {}, {}, {}\n"
        "search     {}\n"
        "files      {}, {}",
        version, made.empty() ? "" : "; made ", made, from.empty() ? "" : " from ", from, width,
        height, 100.0 * resolution, free_area, occupied_area, counted(scans, "scan"),
        duration_text(duration), path, counted(keyframes, "keyframe"), counted(edges, "edge"),
        counted(closures, "loop closure"),
        pyramid ? "ready: its pyramid is stored" : "its pyramid is built each time it is needed",
        counted(files.size(), "file"), size_text(total_of(files)));
    std::size_t longest = 0;
    for (const auto& [name, bytes] : files) {
        longest = std::max(longest, name.size());
    }
    for (const auto& [name, bytes] : files) {
        text += fmt::format("\n           {:<{}}  {}", name, longest, size_text(bytes));
    }
    return text;
}

nlohmann::ordered_json MapReport::json() const {
    nlohmann::ordered_json sizes = nlohmann::ordered_json::object();
    for (const auto& [name, bytes] : files) {
        sizes[name] = bytes;
    }
    return {{"kind", "map"},
            {"version", version},
            {"checksums", "right"},
            {"made", made},
            {"from", from},
            {"width_m", rounded(width)},
            {"height_m", rounded(height)},
            {"resolution_m", rounded(resolution)},
            {"free_m2", rounded(free_area)},
            {"occupied_m2", rounded(occupied_area)},
            {"scans", scans},
            {"duration_s", rounded(duration)},
            {"path_length_m", rounded(path)},
            {"keyframes", keyframes},
            {"edges", edges},
            {"closures", closures},
            {"pyramid", pyramid},
            {"files", files.size()},
            {"megabytes", rounded(1e-6 * static_cast<double>(total_of(files)))},
            {"file_bytes", std::move(sizes)}};
}

GridReport::GridReport(const std::filesystem::path& yaml) {
    const StateGrid grid = read_map_server(yaml);
    resolution = grid.geometry.resolution;
    width = grid.geometry.width * resolution;
    height = grid.geometry.height * resolution;
    x = grid.geometry.origin.x();
    y = grid.geometry.origin.y();
    yaw = grid.origin_yaw;
    free_area = area_of(grid, CellState::kFree);
    occupied_area = area_of(grid, CellState::kOccupied);
    unknown_area = area_of(grid, CellState::kUnknown);
}

std::string GridReport::text() const {
    return fmt::format(
        "map        of map_server: a grid and nothing else, no checksums\n"
        "size       {:.1f} m x {:.1f} m in cells of {:g} cm\n"
        "origin     x {:.2f} m, y {:.2f} m, yaw {:.1f} deg\n"
        "cells      {:.1f} m2 free, {:.1f} m2 occupied, {:.1f} m2 unknown",
        width, height, 100.0 * resolution, x, y, degrees(yaw), free_area, occupied_area,
        unknown_area);
}

nlohmann::ordered_json GridReport::json() const {
    return {
        {"kind", "map_server"},
        {"width_m", rounded(width)},
        {"height_m", rounded(height)},
        {"resolution_m", rounded(resolution)},
        {"origin", {{"x_m", rounded(x)}, {"y_m", rounded(y)}, {"yaw_deg", rounded(degrees(yaw))}}},
        {"free_m2", rounded(free_area)},
        {"occupied_m2", rounded(occupied_area)},
        {"unknown_m2", rounded(unknown_area)}};
}

}  // namespace hybrid_slam::tools
