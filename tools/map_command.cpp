// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands.hpp"
#include "drawings.hpp"
#include "hybrid_slam/backend/map_folder.hpp"
#include "hybrid_slam/core/error.hpp"
#include "interrupt.hpp"
#include "live_input.hpp"
#include "map_onto.hpp"
#include "messages.hpp"
#include "progress.hpp"
#include "session.hpp"
#include "stored_map.hpp"
#include "summary.hpp"
#include "visual_input.hpp"

namespace hybrid_slam::tools {
namespace {

struct MapOptions {
    CommonOptions common;
    std::filesystem::path drive;  ///< log or recording; empty with --live
    bool live = false;
    RobotOptions robot;
    std::filesystem::path onto;  ///< map folder; empty: a map of its own
    std::filesystem::path out;
    std::filesystem::path config;
    Overrides overrides;
};

constexpr auto kFooter = R"(Files of the map folder:
  map.yaml, map.pgm  occupancy grid as map_server has it      map.png    the same with the way driven
  trajectory.tum     pose of the robot at every scan          graph.png  graph before and after
  odometry.tum       the same without the graph               graph.g2o  pose graph
  keyframes.bin, pyramid.bin, points.ply, config.yaml (effective configuration), summary.json, manifest.json
Examples:
  hybrid-slam map intel.clf.gz --out intel_map
  hybrid-slam map hall.clf --out hall_map --config config/thesis.yaml --set icp.max_iterations=50
  hybrid-slam map drive1/ --out hall              # what 'record' or 'simulate' made
  hybrid-slam map --live --robot config/robots/forklift.yaml --out hall
  hybrid-slam map hall.clf --out hall_map --json | jq .closures.by_verdict
  hybrid-slam map drive2/ --onto hall/ --out hall2    # one map of both; hall/ itself stays (unless it is named as --out)
With --onto the drive is found in the stored map, anchored to it wherever its scans fit, and what it saw is gone is
left out. A drive that cannot be placed (exit codes 5: several places look alike, 6: not in that map) gives a map of
its own in OUT_unanchored, and none in OUT.
Ctrl-C or SIGTERM saves the map of the scans so far (exit code 3, live 0); a second one aborts.
)";

std::string session_line(const Session& session) {
    return fmt::format("{}, {:.0f} m in {}; {}, {}{}", counted(session.scans, "scan"), session.path,
                       duration_text(session.recorded),
                       counted(session.map.keyframes.size(), "keyframe"),
                       counted(session.closures_with(ClosureVerdict::kAccepted), "loop closure"),
                       session.interrupted ? "; interrupted" : "");
}

/// What is to be written.
struct Result {
    Session session;
    std::optional<OntoResult> onto;
    std::string subtitle;  ///< of the drive alone, as the text is
    std::string text;

    bool merged() const { return onto && onto->anchored(); }
};

void draw_map(const std::filesystem::path& folder, const Result& result) {
    const StateGrid grid = read_map_server(folder / "map.yaml");
    const Trajectory& all = result.session.map.trajectory;
    const auto drive =
        all.begin() + static_cast<std::ptrdiff_t>(result.merged() ? result.onto->stored_scans : 0);
    const Trajectory trajectory(drive, all.end());
    draw(MapPicture{
             "Map of " + result.session.name + (result.merged() ? " and " + result.onto->map : ""),
             result.subtitle, grid, trajectory, Trajectory(all.begin(), drive)})
        .write_png(folder / "map.png");
}

void draw_graph(const std::filesystem::path& folder, const Result& result) {
    const Session& session = result.session;
    GraphPicture picture;
    picture.title = "Pose graph of " + session.name;
    picture.before_caption = "before: chain of the odometry";
    picture.after_caption =
        fmt::format("after: refined with closures, chi2 {:.1f}", session.refinement.final_chi2);
    for (const Keyframe& keyframe : session.map.keyframes) {
        picture.before.push_back(keyframe.local_from_robot);
    }
    picture.after = session.map.graph.nodes;
    if (result.merged()) {
        picture.title += " and " + result.onto->map;
        picture.after_caption = "after: refined with closures and anchors";
        add_edges(picture, session.map.graph);
    } else {
        for (std::size_t i = 1; i < picture.after.size(); ++i) {
            picture.odometry.emplace_back(i - 1, i);
        }
        add_closures(picture, session.map.closures);
    }
    draw(picture).write_png(folder / "graph.png");
}

/// Writes all files but the manifest, and returns the summary.
nlohmann::ordered_json write_files(const std::filesystem::path& folder, const Result& result,
                                   const Settings& settings) {
    OutputTimings timings;
    const Stopwatch map_clock;
    write_map(folder, result.session.map, settings.map);
    write_text(folder / MapExtras::kConfig, to_yaml(settings));
    timings.write_map = map_clock.seconds();
    const Stopwatch picture_clock;
    draw_map(folder, result);
    draw_graph(folder, result);
    timings.draw_pictures = picture_clock.seconds();
    nlohmann::ordered_json summary = summary_of(result.session, timings);
    if (result.onto) {
        summary["onto"] = to_json(*result.onto);
        summary["timings"]["anchor_s"] = rounded(result.onto->seconds);
    }
    write_text(
        folder / MapExtras::kSummary,
        summary.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
    return summary;
}

std::filesystem::path beside(const std::filesystem::path& out) {
    const std::filesystem::path plain = out.lexically_normal();
    const std::filesystem::path named =
        plain.has_filename() && plain.filename().string().front() != '.'
            ? plain
            : std::filesystem::absolute(plain / "x").lexically_normal().parent_path();
    return named.string() + "_unanchored";
}

/// Where a map goes; with --onto also where the drive's own goes when it cannot be placed. Both are
/// held from the start, so that no work is lost for a place that cannot be written.
struct Places {
    explicit Places(const MapOptions& options) {
        out.emplace(options.out);
        if (!options.onto.empty()) {
            own_folder = beside(options.out);
            own.emplace(own_folder);
        }
    }

    std::optional<MapFolderWriter> out;
    std::filesystem::path own_folder;
    std::optional<MapFolderWriter> own;
};

std::unique_ptr<Input> input_of(const MapOptions& options, const Settings& settings) {
    const bool images = uses_images(settings);
    return with_vision(options.live
                           ? open_live_input(robot_of(options.robot), images)
                           : open_input(options.drive, settings.log, options.robot.robot, images),
                       settings.vision);
}

/// Live sensors have no end but a signal: only what it stops early is interrupted.
Session map_drive(const MapOptions& options, const Settings& settings) {
    const std::string name = options.live ? "live drive" : name_of(options.drive);
    const std::unique_ptr<Input> input = input_of(options, settings);
    Session session;
    {
        Progress progress(name, options.common.quiet);
        session = run_session(*input, name, settings, progress);
    }
    session.interrupted = session.interrupted && !options.live;
    if (!session.warnings.empty()) {
        print_info(fmt::format("{}: {}", name, fmt::join(session.warnings, "; ")));
    }
    for (const std::string& warning : session.vision.warnings()) {
        print_warning(warning);
    }
    if (session.interrupted) {
        print_warning("interrupted; saving the map of the scans so far");
    }
    return session;
}

int exit_code_of(const Result& result) {
    if (result.onto && !result.merged()) {
        return result.onto->anchoring.verdict == AnchoringVerdict::kAmbiguous ? kAmbiguous
                                                                              : kNotInMap;
    }
    return result.session.interrupted ? kInterrupted : kOk;
}

int run_map(const MapOptions& options) {
    const Settings settings = load_settings(options.config, options.overrides);
    catch_interrupts();
    Places places(options);
    std::optional<OntoMap> onto;
    if (!options.onto.empty()) {
        onto.emplace(options.onto);
    }
    Result result;
    result.session = map_drive(options, settings);
    result.subtitle = session_line(result.session);
    result.text = summary_text(result.session);
    std::filesystem::path folder = options.out;
    MapFolderWriter* writer = &*places.out;
    if (onto) {
        result.onto = onto->anchor(result.session.map, settings);
        if (result.merged()) {
            result.text += "\n" + text_of(*result.onto);
        } else {
            folder = places.own_folder;
            writer = &*places.own;
        }
    }
    const nlohmann::ordered_json summary = write_files(writer->path(), result, settings);
    writer->commit();
    if (onto && !result.merged()) {
        print_error(fmt::format("{}: {}; its own map is in {}", result.session.name,
                                text_of(*result.onto), folder.string()));
    }
    if (options.common.json) {
        print_json(summary);
    } else {
        print_result(result.text + "\nmap        " + folder.string());
    }
    return exit_code_of(result);
}

}  // namespace

void add_map_command(CLI::App& program, Action& action) {
    const auto options = std::make_shared<MapOptions>();
    CLI::App* command =
        program.add_subcommand("map", "Make a map from a recording, a log or live sensors");
    command
        ->add_option("DRIVE", options->drive, "Folder of a recording, or CARMEN log (plain or .gz)")
        ->type_name("");
    command->add_flag("--live", options->live,
                      "Map what the robot's devices say now, until Ctrl-C");
    add_robot_options(*command, options->robot);
    command->add_option("-o,--out", options->out, "Folder of the map; a map in it is replaced")
        ->required()
        ->type_name("DIR");
    command
        ->add_option("--onto", options->onto,
                     "Stored map (folder) to anchor the drive to; OUT becomes the map of both")
        ->type_name("DIR");
    add_config_option(*command, options->config);
    add_set_option(*command, options->overrides, "icp.max_iterations=50");
    command->add_flag_callback(
        "--no-graph", [options] { options->overrides.emplace_back("graph.enabled=false"); },
        "Odometry alone, the same as --set graph.enabled=false");
    add_common_options(*command, options->common);
    command->footer(kFooter);
    command->callback([options, &action] {
        if (options->live != options->drive.empty()) {
            throw CLI::RequiredError("either DRIVE or --live");
        }
        const RobotOptions& robot = options->robot;
        if (!options->live && (!robot.lidar.empty() || !robot.camera.empty() || robot.no_camera)) {
            throw CLI::RequiresError("--lidar, --camera and --no-camera", "--live");
        }
        action = [options] { return run_map(*options); };
    });
}

}  // namespace hybrid_slam::tools
