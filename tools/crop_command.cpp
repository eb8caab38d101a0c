// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "commands.hpp"
#include "hybrid_slam/backend/map_crop.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"
#include "input.hpp"
#include "messages.hpp"
#include "stored_map.hpp"

namespace hybrid_slam::tools {
namespace {

namespace fs = std::filesystem;

struct CropOptions {
    CommonOptions common;
    fs::path map;
    fs::path out;
    std::vector<double> box;
    std::vector<std::string> polygon;
    bool outside = false;
};

constexpr auto kFooter =
    R"(Coordinates are metres in the map, as map.yaml has them. Kept are the keyframes whose pose is in the area, with
those of their points that are in it; the same of the trajectories. Where the way led through keyframes that are
dropped, one edge of the graph takes its place: the relative pose as it is, the uncertainty summed up over the way.
What is seen of the area from outside of it goes with the keyframes there: leave some room around.
Examples:
  hybrid-slam crop hall --box=-2,-2,12,8 --out hall_west
  hybrid-slam crop hall --polygon 0,0 10,0 10,6 4,9 --out office
  hybrid-slam crop hall --box 4,1,6,3 --outside --out hall_without_yard
Exit codes: 0 done; 1 the map cannot be read, nothing would be left, or NEW cannot be written; 2 wrong usage.
)";

Point2 corner_of(const std::string& text) {
    const std::size_t comma = text.find(',');
    Point2 corner;
    if (comma == std::string::npos ||
        !parse_double(std::string_view(text).substr(0, comma), corner.x()) ||
        !parse_double(std::string_view(text).substr(comma + 1), corner.y()) ||
        !corner.allFinite()) {
        throw CLI::ValidationError("--polygon", "'" + text + "' is no corner like 1.5,-2");
    }
    return corner;
}

MapArea area_of(const CropOptions& options) {
    MapArea area;
    area.outside = options.outside;
    if (options.box.empty()) {
        for (const std::string& corner : options.polygon) {
            area.polygon.push_back(corner_of(corner));
        }
        return area;
    }
    if (!std::all_of(options.box.begin(), options.box.end(),
                     [](double corner) { return std::isfinite(corner); })) {
        throw CLI::ValidationError("--box", "must be four numbers");
    }
    const auto [x0, x1] = std::minmax(options.box[0], options.box[2]);
    const auto [y0, y1] = std::minmax(options.box[1], options.box[3]);
    area.polygon = {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
    return area;
}

nlohmann::ordered_json summary_of(const CropOptions& options, const MapArea& area,
                                  const StoredMap& before, const SlamMap& after) {
    nlohmann::ordered_json corners = nlohmann::ordered_json::array();
    for (const Point2& corner : area.polygon) {
        corners.push_back({corner.x(), corner.y()});
    }
    return {{"program", "hybrid-slam " HYBRID_SLAM_VERSION},
            {"log", drive_of(options.map)},
            {"cropped_from", name_of(options.map)},
            {"area", {{"polygon", corners}, {"outside", area.outside}}},
            {"scans", after.trajectory.size()},
            {"keyframes", after.keyframes.size()},
            {"dropped_keyframes", before.keyframes.size() - after.keyframes.size()},
            {"edges", after.graph.edges.size()}};
}

int run_crop(const CropOptions& options, const MapArea& area) {
    std::error_code ignored;
    if (fs::equivalent(options.map, options.out, ignored)) {
        throw Error(options.out.string() + ": is the map itself; name another --out");
    }
    const StoredMap before = open_map_folder(options.map);
    const SlamMap after = crop(before, area);
    MapFolderWriter writer(options.out);
    OccupancyGridConfig grid;
    grid.resolution = before.grid.geometry.resolution;
    write_map(writer.path(), after, grid);
    const fs::path config = options.map / MapExtras::kConfig;
    if (fs::is_regular_file(config)) {
        fs::copy_file(config, writer.path() / MapExtras::kConfig);
    }
    const nlohmann::ordered_json summary = summary_of(options, area, before, after);
    write_text(
        writer.path() / MapExtras::kSummary,
        summary.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
    writer.commit();
    if (options.common.json) {
        print_json(summary);
    } else if (!options.common.quiet) {
        print_result(fmt::format(
            "kept       {} of {}, {}, {}\nmap        {}", with_commas(after.keyframes.size()),
            counted(before.keyframes.size(), "keyframe"), counted(after.graph.edges.size(), "edge"),
            counted(after.trajectory.size(), "scan"), options.out.string()));
    }
    return kOk;
}

}  // namespace

void add_crop_command(CLI::App& program, Action& action) {
    const auto options = std::make_shared<CropOptions>();
    CLI::App* command = program.add_subcommand("crop", "Make a map of a part of a map");
    command->add_option("MAP", options->map, "Map folder")->required()->type_name("");
    command->add_option("-o,--out", options->out, "Folder of the new map; a map in it is replaced")
        ->required()
        ->type_name("NEW");
    CLI::Option* box = command->add_option("--box", options->box, "Two opposite corners, metres")
                           ->delimiter(',')
                           ->expected(4)
                           ->type_name("X0,Y0,X1,Y1");
    command->add_option("--polygon", options->polygon, "Three corners or more, metres, in order")
        ->expected(3, 10000)
        ->type_name("X,Y ...")
        ->excludes(box);
    command->add_flag("--outside", options->outside, "Keep what is outside of the area instead");
    add_common_options(*command, options->common);
    command->footer(kFooter);
    command->callback([options, &action] {
        if (options->box.empty() == options->polygon.empty()) {
            throw CLI::RequiredError("either --box or --polygon");
        }
        action = [options, area = area_of(*options)] { return run_crop(*options, area); };
    });
}

}  // namespace hybrid_slam::tools
