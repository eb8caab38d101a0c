// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "hybrid_slam/core/error.hpp"
#include "interrupt.hpp"
#include "live_input.hpp"
#include "map_identity.hpp"
#include "messages.hpp"
#include "output_guard.hpp"
#include "place_pictures.hpp"
#include "place_query.hpp"
#include "place_report.hpp"
#include "scan_file.hpp"
#include "settings.hpp"
#include "stored_map.hpp"
#include "visual_input.hpp"

namespace hybrid_slam::tools {
namespace {

struct RelocalizeOptions {
    CommonOptions common;
    std::filesystem::path map;
    std::filesystem::path scan;   ///< of the three one is given: this,
    std::filesystem::path drive;  ///< this,
    bool live = false;            ///< or this
    RobotOptions robot;
    QuerySpan span;
    std::filesystem::path config;
    Overrides overrides;
    std::filesystem::path png;
    std::filesystem::path save_scan;
};

constexpr auto kFooter =
    R"(MAP is a map folder, or the .yaml file of a map_server map that somebody else made.
Exit codes: 0 found; 5 ambiguous, several places look alike: drive a little and ask with --drive;
            6 not in this map; 1 bad input or another failure; 2 wrong usage; 3 interrupted.
Examples:
  hybrid-slam relocalize hall/ --scan scan.json
  hybrid-slam relocalize hall/ drive2/ --at 12.5 --png there.png
  hybrid-slam relocalize hall/ drive2/ --drive 5           # the scans of 5 m, tied by odometry
  hybrid-slam relocalize hall/ --live --robot config/robots/forklift.yaml
  hybrid-slam relocalize hall/ drive2/ --save-scan scan.json
  hybrid-slam relocalize hall/ drive2/ --set relocalization.method=headings   # as the thesis does
docs/localization.md tells more, docs/formats.md what is in scan.json.
)";

struct Answer {
    PlaceQuery asked;
    std::string asked_of;  ///< name of the scan or the drive
    std::shared_ptr<const ReferenceMap> map;
    Relocalization found;
    double read_seconds = 0.0;  ///< of the map
    double seconds = 0.0;       ///< of the search
};

int exit_code_of(PlaceVerdict verdict) {
    switch (verdict) {
        case PlaceVerdict::kFound:
            return kOk;
        case PlaceVerdict::kNotInMap:
            return kNotInMap;
        default:
            return kAmbiguous;
    }
}

PlaceQuery ask_for(const RelocalizeOptions& options, const Settings& settings) {
    const LocalizationConfig config = localization_of(settings);
    if (!options.scan.empty()) {
        PlaceQuery query = query_of(read_scan(options.scan), config);
        expect_enough(query, options.scan.string());
        return query;
    }
    const bool images = uses_images(settings) && options.span.drive > 0.0;
    const std::unique_ptr<Input> input = with_vision(
        options.live ? open_live_input(robot_of(options.robot), images)
                     : open_input(options.drive, settings.log, options.robot.robot, images),
        settings.vision);
    return collect_query(*input, options.live ? "live scanner" : options.drive.string(), config,
                         options.span);
}

Answer answer_to(const RelocalizeOptions& options, const Settings& settings) {
    Answer answer;
    answer.asked_of = !options.scan.empty() ? options.scan.filename().string()
                      : options.live        ? "live scanner"
                                            : name_of(options.drive);
    const Stopwatch read_clock;
    answer.map = open_reference_map(options.map);
    answer.read_seconds = read_clock.seconds();
    const Relocalizer relocalizer(answer.map, settings.localization.relocalization,
                                  settings.slam.odometry.icp);
    answer.asked = ask_for(options, settings);
    if (!answer.asked.query.empty()) {
        const Stopwatch clock;
        answer.found = relocalizer.find(answer.asked.query);
        answer.seconds = clock.seconds();
    }
    return answer;
}

std::size_t points_of(const Query& query) {
    std::size_t points = 0;
    for (const Sweep& sweep : query) {
        points += sweep.surface.size();
    }
    return points;
}

std::string asked_text(const Answer& answer) {
    const PlaceQuery& asked = answer.asked;
    return fmt::format("{} with {}{}", counted(asked.query.size(), "scan"),
                       counted(points_of(asked.query), "point"),
                       asked.path > 0.0 ? fmt::format(" along {:.1f} m", asked.path) : "");
}

std::string report(const Answer& answer) {
    return fmt::format(
        "{}\nasked      {}, stamp {:.3f}\neffort     {} in {:.1f} ms; map read in {:.1f} s",
        text_of(answer.found), asked_text(answer), answer.asked.scan.stamp,
        counted(answer.found.nodes, "node"), 1e3 * answer.seconds, answer.read_seconds);
}

nlohmann::ordered_json json_of(const RelocalizeOptions& options, const Answer& answer) {
    const PlaceQuery& asked = answer.asked;
    nlohmann::ordered_json json = {
        {"program", "hybrid-slam " HYBRID_SLAM_VERSION},
        {"map", {{"path", options.map.string()}, {"identity", identity_of(*answer.map)}}},
        {"asked",
         {{"of", answer.asked_of},
          {"stamp", asked.scan.stamp},
          {"scans", asked.query.size()},
          {"points", points_of(asked.query)},
          {"path_m", rounded(asked.path)},
          {"complete", asked.complete}}}};
    json.update(to_json(answer.found));
    json["timings"] = {{"search_ms", rounded(1e3 * answer.seconds)},
                       {"read_map_s", rounded(answer.read_seconds)}};
    return json;
}

void draw_answer(const RelocalizeOptions& options, const Answer& answer) {
    const Relocalization& found = answer.found;
    const std::string subtitle =
        fmt::format("{}{}; {}", words_for(found.verdict),
                    found.verdict == PlaceVerdict::kFound
                        ? ": " + pose_text(found.places.front().map_from_robot)
                        : "",
                    asked_text(answer));
    draw(PlacesPicture{answer.asked_of + " in " + name_of(options.map), subtitle, *answer.map,
                       found, answer.asked.query})
        .write_png(options.png);
    print_info("wrote " + options.png.string());
}

void check_outputs(const RelocalizeOptions& options) {
    if (!options.png.empty()) {
        expect_replaceable(options.png, "\x89PNG");
    }
    if (!options.save_scan.empty()) {
        expect_replaceable(options.save_scan, "{");
    }
}

int run_relocalize(const RelocalizeOptions& options) {
    check_outputs(options);
    const Settings settings = load_settings(options.config, options.overrides);
    catch_interrupts();
    const Answer answer = answer_to(options, settings);
    if (answer.asked.query.empty()) {
        print_warning("interrupted before a scan was good enough");
        return kInterrupted;
    }
    if (!answer.asked.complete) {
        print_warning(fmt::format("{} ends after {:.1f} m of the {:g} m asked for", answer.asked_of,
                                  answer.asked.path, options.span.drive));
    }
    if (!options.save_scan.empty()) {
        write_scan(options.save_scan, answer.asked.scan);
        print_info("wrote " + options.save_scan.string());
    }
    if (!options.png.empty()) {
        draw_answer(options, answer);
    }
    if (options.common.json) {
        print_json(json_of(options, answer));
    } else {
        print_result(report(answer));
    }
    return exit_code_of(answer.found.verdict);
}

void check_usage(const RelocalizeOptions& options, const CLI::App& command) {
    const int given =
        (options.scan.empty() ? 0 : 1) + (options.drive.empty() ? 0 : 1) + (options.live ? 1 : 0);
    if (given == 0) {
        throw CLI::RequiredError("one of DRIVE, --scan and --live");
    }
    if (given > 1) {
        throw CLI::ValidationError("DRIVE, --scan and --live exclude each other");
    }
    const RobotOptions& robot = options.robot;
    if (!options.live && (!robot.lidar.empty() || !robot.camera.empty() || robot.no_camera)) {
        throw CLI::RequiresError("--lidar, --camera and --no-camera", "--live");
    }
    for (const char* name : {"--at", "--drive", "--robot", "--save-scan"}) {
        if (!options.scan.empty() && command.count(name) > 0) {
            throw CLI::ExcludesError("--scan", name);
        }
    }
    if (!std::isfinite(options.span.at) || !std::isfinite(options.span.drive)) {
        throw CLI::ValidationError("--at, --drive", "must be numbers");
    }
    if (options.live && command.count("--at") > 0) {
        throw CLI::ExcludesError("--live", "--at");
    }
}

void add_query_options(CLI::App& command, RelocalizeOptions& options) {
    command.add_option("--scan", options.scan, "One scan (JSON) in place of a drive")
        ->type_name("FILE");
    command.add_flag("--live", options.live, "What the robot's scanner says now");
    command
        .add_option("--at", options.span.at,
                    "Seconds after the start of the drive at which to look (0)")
        ->check(CLI::Range(0.0, 1e9).description(""))
        ->type_name("S");
    command
        .add_option("--drive", options.span.drive,
                    "Metres from there whose scans are looked at together; the pose is that of the "
                    "last (0: one scan)")
        ->check(CLI::Range(0.0, 1e4).description(""))
        ->type_name("M");
    add_robot_options(command, options.robot);
}

}  // namespace

void add_relocalize_command(CLI::App& program, Action& action) {
    const auto options = std::make_shared<RelocalizeOptions>();
    CLI::App* command = program.add_subcommand(
        "relocalize", "Find the place of a scan in a stored map, without any idea where it is");
    command->add_option("MAP", options->map, "Folder of a map, or .yaml file of a map_server map")
        ->required()
        ->type_name("");
    command
        ->add_option("DRIVE", options->drive, "Folder of a recording, or CARMEN log (plain or .gz)")
        ->type_name("");
    add_query_options(*command, *options);
    command->add_option("--png", options->png, "Draws the map, the places and the scan")
        ->type_name("FILE");
    command
        ->add_option("--save-scan", options->save_scan,
                     "Writes the (last) scan of the drive as JSON, for --scan")
        ->type_name("FILE");
    add_config_option(*command, options->config);
    add_set_option(*command, options->overrides, "relocalization.margin=0.1");
    add_common_options(*command, options->common);
    command->footer(kFooter);
    command->callback([options, command, &action] {
        check_usage(*options, *command);
        action = [options] { return run_relocalize(*options); };
    });
}

}  // namespace hybrid_slam::tools
