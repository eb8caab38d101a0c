// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "hybrid_slam/backend/g2o.hpp"
#include "hybrid_slam/backend/map_folder.hpp"
#include "hybrid_slam/backend/point_cloud.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"
#include "hybrid_slam/localization/reference_map.hpp"
#include "messages.hpp"
#include "output_guard.hpp"
#include "stored_map.hpp"

namespace hybrid_slam::tools {
namespace {

namespace fs = std::filesystem;

enum class Format { kMapServer, kPly, kPcd, kG2o, kTum };

struct FormatNames {
    Format format;
    const char* name;
    const char* suffix;
    bool of_grids;  ///< can be made of a map_server map too
};

constexpr std::array<FormatNames, 5> kFormats{{{Format::kMapServer, "map_server", ".yaml", true},
                                               {Format::kPly, "ply", ".ply", true},
                                               {Format::kPcd, "pcd", ".pcd", true},
                                               {Format::kG2o, "g2o", ".g2o", false},
                                               {Format::kTum, "tum", ".tum", false}}};

struct ExportOptions {
    CommonOptions common;
    fs::path map;
    fs::path out;
    std::string format;  ///< empty: by the suffix of `out`
};

constexpr auto kFooter =
    R"(MAP is a map folder, or the .yaml file of a map_server map that somebody else made. X.yaml brings X.pgm.
  map_server  occupancy grid for map_server and Nav2           .yaml  of both kinds of MAP
  ply, pcd    points on the walls, ASCII, metres, z is 0       .ply   of both kinds of MAP
                                                               .pcd
  g2o         pose graph, one vertex for each keyframe         .g2o   of map folders
  tum         pose of the robot in the map at every scan       .tum   of map folders
A file of the same format under that name is replaced; any other stays and is an error, as are those of a map folder.
Examples:
  hybrid-slam export hall --out hall.yaml          # for map_server and Nav2
  hybrid-slam export hall --out walls.pcd          # pcl_viewer walls.pcd
  hybrid-slam export hall --out graph.txt --format g2o
  hybrid-slam export theirs.yaml --out walls.ply
Exit codes: 0 done; 1 the map cannot be read, or the file must not or cannot be written; 2 wrong usage.
)";

const FormatNames& format_of(const ExportOptions& options) {
    for (const FormatNames& names : kFormats) {
        if (options.format.empty() ? options.out.extension() == names.suffix
                                   : options.format == names.name) {
            return names;
        }
    }
    throw Error(fmt::format("{}: its suffix is none of .yaml .ply .pcd .g2o .tum; name a --format",
                            options.out.string()));
}

std::string first_line_of(const fs::path& file) {
    constexpr std::streamsize kLongest = 200;
    std::ifstream stream(file, std::ios::binary);
    std::string head(kLongest, '\0');
    stream.read(head.data(), kLongest);
    head.resize(static_cast<std::size_t>(stream.gcount()));
    return head.substr(0, head.find('\n'));
}

bool starts_with(std::string_view text, std::string_view start) {
    return text.substr(0, start.size()) == start;
}

/// Whether a file that is there could have been written by this command.
bool is_of(Format format, const fs::path& file) {
    const std::string line = first_line_of(file);
    Tokens tokens(line);
    double number = 0.0;
    switch (format) {
        case Format::kMapServer:
            return starts_with(line, "image:");
        case Format::kPly:
            return starts_with(line, "ply");
        case Format::kPcd:
            return starts_with(line, "# .PCD") || starts_with(line, "VERSION");
        case Format::kG2o:
            return starts_with(line, "VERTEX_") || starts_with(line, "EDGE_") ||
                   starts_with(line, "FIX ");
        case Format::kTum:
            for (int i = 0; i < 8; ++i) {
                if (!parse_double(tokens.next(), number)) {
                    return false;
                }
            }
            return true;
    }
    return false;
}

[[noreturn]] void refuse(const fs::path& file, const std::string& why) {
    throw Error(file.string() + ": " + why + ", so it is not replaced; name another --out");
}

fs::path image_beside(const fs::path& yaml) {
    fs::path image = yaml;
    return image.replace_extension(".pgm");
}

/// Before the work, and so that nobody loses what is not ours or a file of a map.
void expect_replaceable(const ExportOptions& options, const FormatNames& names) {
    const fs::path target = replaceable_file(options.out);
    const fs::path folder = fs::absolute(target).parent_path();
    if (is_map_or_recording(folder)) {
        throw Error(
            fmt::format("{}: a map or recording is in that folder, nothing may be put "
                        "beside its files; name another --out",
                        options.out.string()));
    }
    if (fs::exists(target) && fs::file_size(target) > 0 && !is_of(names.format, target)) {
        refuse(options.out, fmt::format("is not of format {}", names.name));
    }
    if (names.format == Format::kMapServer) {
        const fs::path image = replaceable_file(image_beside(options.out));
        if (image == target) {
            throw Error(options.out.string() + ": the grid's image needs that name; take .yaml");
        }
        if (fs::exists(image) && !starts_with(first_line_of(image), "P5")) {
            refuse(image_beside(options.out), "is no PGM image");
        }
    }
}

/// What can be exported, of either kind of map.
struct Exportable {
    std::optional<StoredMap> stored;
    StateGrid grid;

    Points points() const {
        return stored ? draw_points(stored->keyframes, stored->graph, grid.geometry.resolution)
                      : reference_of(grid)->surface().points;
    }
};

Exportable read_exportable(const ExportOptions& options, const FormatNames& names) {
    if (is_map_server_file(options.map)) {
        if (!names.of_grids) {
            throw Error(
                fmt::format("{}: a map_server map has nothing for format {}; it needs a "
                            "map folder",
                            options.map.string(), names.name));
        }
        return {std::nullopt, read_map_server(options.map)};
    }
    Exportable exportable;
    exportable.stored = open_map_folder(options.map);
    exportable.grid = exportable.stored->grid;
    return exportable;
}

/// Returns how many records were written, and their noun.
std::pair<std::size_t, const char*> write(const Exportable& map, Format format,
                                          const fs::path& file) {
    switch (format) {
        case Format::kMapServer:
            write_map_server(file, map.grid);
            return {map.grid.states.size(), "cell"};
        case Format::kG2o:
            write_g2o(file, map.stored->graph);
            return {map.stored->graph.nodes.size(), "vertex"};
        case Format::kTum:
            write_tum(file, map.stored->trajectory);
            return {map.stored->trajectory.size(), "pose"};
        case Format::kPly:
        case Format::kPcd:
            break;
    }
    const Points points = map.points();
    format == Format::kPly ? write_ply(file, points) : write_pcd(file, points);
    return {points.size(), "point"};
}

int run_export(const ExportOptions& options) {
    const FormatNames& names = format_of(options);
    expect_replaceable(options, names);
    const Exportable map = read_exportable(options, names);
    const auto [count, noun] = write(map, names.format, options.out);
    std::vector<std::string> files{options.out.string()};
    if (names.format == Format::kMapServer) {
        files.push_back(image_beside(options.out).string());
    }
    if (options.common.json) {
        print_json({{"format", names.name}, {"files", files}, {"records", count}});
    } else if (!options.common.quiet) {
        print_result(fmt::format("{:<10} {} ({} {}{})", names.name, fmt::join(files, ", "),
                                 with_commas(count),
                                 count == 1                           ? noun
                                 : std::string_view(noun) == "vertex" ? "vertices"
                                                                      : noun,
                                 count == 1 || std::string_view(noun) == "vertex" ? "" : "s"));
    }
    return kOk;
}

std::vector<std::string> format_names() {
    std::vector<std::string> names;
    names.reserve(kFormats.size());
    for (const FormatNames& format : kFormats) {
        names.emplace_back(format.name);
    }
    return names;
}

}  // namespace

void add_export_command(CLI::App& program, Action& action) {
    const auto options = std::make_shared<ExportOptions>();
    CLI::App* command =
        program.add_subcommand("export", "Write a map as a file that other programs read");
    command->add_option("MAP", options->map, "Map folder, or map_server .yaml")
        ->required()
        ->type_name("");
    command->add_option("-o,--out", options->out, "File to be written")
        ->required()
        ->type_name("FILE");
    command
        ->add_option("--format", options->format,
                     "map_server, ply, pcd, g2o or tum; by the suffix of --out when left out")
        ->check(CLI::IsMember(format_names()).description(""))
        ->type_name("NAME");
    add_common_options(*command, options->common);
    command->footer(kFooter);
    command->callback([options, &action] { action = [options] { return run_export(*options); }; });
}

}  // namespace hybrid_slam::tools
