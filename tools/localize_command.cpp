// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/io/endpoint.hpp"
#include "hybrid_slam/recording/recording.hpp"
#include "interrupt.hpp"
#include "live_input.hpp"
#include "localization_report.hpp"
#include "localization_run.hpp"
#include "localization_start.hpp"
#include "map_identity.hpp"
#include "messages.hpp"
#include "place_pictures.hpp"
#include "place_report.hpp"
#include "pose_publisher.hpp"
#include "run_folder.hpp"
#include "run_yardstick.hpp"
#include "stored_map.hpp"
#include "visual_input.hpp"

namespace hybrid_slam::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct LocalizeOptions {
    CommonOptions common;
    fs::path map;
    fs::path drive;  ///< log or recording; empty with --live
    bool live = false;
    RobotOptions robot;
    PublishOptions publish;
    fs::path out;
    StartOptions start;
    YardstickFiles yardstick;
    bool own_truth = false;  ///< is that of the recording, nobody asked for it
    fs::path map_truth;
    fs::path config;
    Overrides overrides;
};

constexpr double kLiveSearch = 0.5;  ///< seconds of a search at most, unless configured

constexpr auto kFooter =
    R"(MAP is a map folder, or the .yaml file of a map_server map that somebody else made.
Without --initial-pose and --resume the start is unknown, and the whole map is searched.
Files of the run folder:
  trajectory.tum     pose in the map at each scan, while known   localize.png   the map with the way driven
  camera_poses.tum   the same at each image                      summary.json   what the terminal says, and more
  poses.csv          each scan: status, pose, sigmas, fit        config.yaml    effective configuration
  events.jsonl       searches, jumps, changes of the status      last_pose.json for --resume
Exit codes: 0 done; 5 never found, several places look alike; 6 never found, not in this map;
            1 bad input or another failure; 2 wrong usage; 3 interrupted, all is saved
            (live, where Ctrl-C is the end: 3 only before the first scan).
Examples:
  hybrid-slam localize hall/ drive2/ --out run2/
  hybrid-slam localize hall/ drive2/ --out run2/ --initial-pose=1.5,-2,90 --initial-sigma 0.5,10
  hybrid-slam localize hall/ --live --robot config/robots/forklift.yaml --out run/ --resume run/
  hybrid-slam localize hall/ --live --robot forklift.yaml --publish tcp://truck:5000 --resume last_pose.json
  hybrid-slam localize hall/ drive2/ --out run2/ --map-truth drive1/truth.tum --json | jq .truth
docs/localization.md tells more.
)";

Settings settings_of(const LocalizeOptions& options) {
    Settings defaults;
    if (options.live) {
        defaults.localization.relocalization.max_seconds = kLiveSearch;
    }
    return load_settings(options.config, options.overrides, defaults);
}

std::unique_ptr<Input> input_of(const LocalizeOptions& options, const Settings& settings) {
    const bool images = uses_images(settings);
    return with_vision(
        options.live ? open_live_input(robot_of(options.robot), images,
                                       {options.robot.clock, !options.publish.servers.empty()})
                     : open_input(options.drive, settings.log, options.robot.robot, images),
        settings.vision);
}

/// A truth that only lies beside the drive is no reason to fail.
std::optional<RunYardstick> yardstick_of(const LocalizeOptions& options) {
    if (!options.map_truth.empty() && options.yardstick.truth.empty()) {
        throw Error("--map-truth: there is no --truth to hold the poses against");
    }
    if (options.yardstick.truth.empty() && options.yardstick.relations.empty()) {
        return std::nullopt;
    }
    try {
        return RunYardstick(options.yardstick, options.map, options.map_truth);
    } catch (const Error& error) {
        if (!options.own_truth || !options.map_truth.empty()) {
            throw;
        }
        print_warning(std::string("not held against the truth: ") + error.what());
        return std::nullopt;
    }
}

std::optional<RunTruth> measure(const std::optional<RunYardstick>& yardstick,
                                const LocalizationRun& run) {
    if (!yardstick || run.trajectory.size() < 2) {
        return std::nullopt;
    }
    try {
        return yardstick->measure(run.trajectory);
    } catch (const Error& error) {
        print_warning(std::string("not held against the truth: ") + error.what());
        return std::nullopt;
    }
}

void draw_way(const RunFolder& folder, const LocalizeOptions& options, const ReferenceMap& map,
              const LocalizationRun& run) {
    const std::string subtitle = fmt::format(
        "{} in {}; {:.1f} % tracking, {:.1f} % degraded; {}", counted(run.scans, "scan"),
        duration_text(run.recorded), 100.0 * run.share_of(LocalizationStatus::kTracking),
        100.0 * run.share_of(LocalizationStatus::kDegraded), counted(run.jumps.size(), "jump"));
    draw(WayPicture{run.name + " in " + name_of(options.map), subtitle, map, run.way, run.jumps})
        .write_png(folder / RunFiles::kPicture);
}

Json summary_of_run(const LocalizeOptions& options, const ReferenceMap& map,
                    const LocalizationRun& run, const std::optional<RunTruth>& truth) {
    Json summary = {{"format", kRunFormat},
                    {"version", kRunVersion},
                    {"finished", true},
                    {"program", "hybrid-slam " HYBRID_SLAM_VERSION},
                    {"map", {{"path", options.map.string()}, {"identity", identity_of(map)}}}};
    summary.update(summary_of(run, truth));
    return summary;
}

Json write_files(const RunFolder& folder, const LocalizeOptions& options, const ReferenceMap& map,
                 const LocalizationRun& run, const std::optional<RunTruth>& truth) {
    if (!run.trajectory.empty()) {
        write_tum(folder / RunFiles::kTrajectory, run.trajectory);
    }
    if (!run.camera_poses.empty()) {
        write_tum(folder / RunFiles::kCameraPoses, run.camera_poses);
    }
    draw_way(folder, options, map, run);
    Json summary = summary_of_run(options, map, run, truth);
    replace_text(folder / RunFiles::kSummary,
                 summary.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
    return summary;
}

int exit_code_of(const LocalizationRun& run) {
    if (run.interrupted) {
        return kInterrupted;
    }
    if (run.found_after) {
        return kOk;
    }
    return run.why_not_found() == PlaceVerdict::kNotInMap ? kNotInMap : kAmbiguous;
}

/// nullptr when nobody is to be told.
std::unique_ptr<PosePublisher> publisher_of(const LocalizeOptions& options,
                                            const Settings& settings,
                                            const std::shared_ptr<const ReferenceMap>& map,
                                            const std::string& identity, const Input& input) {
    if (options.publish.servers.empty()) {
        return nullptr;
    }
    PosePublisher::Setup setup;
    setup.map = map;
    setup.identity = identity;
    setup.vehicle = robot_of(options.robot).vehicle;
    setup.surroundings = settings.surroundings;
    setup.now = [&input] { return input.now(); };
    setup.lockstep = !options.robot.clock.empty();
    return std::make_unique<PosePublisher>(options.publish, std::move(setup));
}

LocalizationRun run_into(const RunFolder* folder, const LocalizeOptions& options,
                         const Settings& settings, const std::shared_ptr<const ReferenceMap>& map) {
    const std::string identity = identity_of(*map);
    const LocalizationStart start = start_of(options.start, options.out, options.map, *map);
    Localizer localizer(map, localization_of(settings));
    if (start.map_from_robot) {
        localizer.start_at(*start.map_from_robot, start.covariance);
    }
    const std::unique_ptr<Input> input = input_of(options, settings);
    LocalizationLog::Start log_start;
    log_start.last_pose.map = options.map.string();
    log_start.last_pose.map_identity = identity;
    log_start.keep_last_pose = resumes_itself(options.start, options.out);
    if (folder != nullptr) {
        log_start.last_pose_file = *folder / RunFiles::kLastPose;
    } else if (!options.start.resume.empty()) {
        log_start.last_pose_file = last_pose_file(options.start.resume);
    }
    log_start.event = start.event;
    log_start.config = to_yaml(settings);
    LocalizationLog log(folder, std::move(log_start));
    const std::string name = options.live ? "live drive" : name_of(options.drive);
    LocalizationMonitor monitor(name, options.live, options.common.quiet);
    const std::unique_ptr<PosePublisher> publisher =
        publisher_of(options, settings, map, identity, *input);
    LocalizationRun run = run_localization(*input, localizer, log, monitor, publisher.get());
    if (publisher) {
        run.input["published"] = publisher->counts();
    }
    return run;
}

int run_localize(const LocalizeOptions& options) {
    const Settings settings = settings_of(options);
    catch_interrupts();
    const std::optional<RunYardstick> yardstick = yardstick_of(options);
    std::optional<RunFolder> folder;
    if (!options.out.empty()) {
        folder.emplace(options.out);
    }
    const std::shared_ptr<const ReferenceMap> map = open_reference_map(options.map);
    LocalizationRun run = run_into(folder ? &*folder : nullptr, options, settings, map);
    if (run.scans == 0) {
        print_warning("interrupted before a scan came; nothing was written");
        return kInterrupted;
    }
    run.interrupted = run.interrupted && !options.live;
    if (!run.warnings.empty()) {
        print_info(fmt::format("{}: {}", run.name, fmt::join(run.warnings, "; ")));
    }
    for (const std::string& warning : run.vision.warnings()) {
        print_warning(warning);
    }
    if (run.interrupted) {
        print_warning("interrupted; all up to there is saved");
    }
    const std::optional<RunTruth> truth = measure(yardstick, run);
    const Json summary = folder ? write_files(*folder, options, *map, run, truth)
                                : summary_of_run(options, *map, run, truth);
    if (options.common.json) {
        print_json(summary);
    } else {
        print_result(summary_text(run, truth) +
                     (folder ? "\nrun        " + options.out.string() : ""));
    }
    return exit_code_of(run);
}

/// A simulated recording brings the truth along.
void take_own_truth(LocalizeOptions& options) {
    const fs::path own = options.drive / RecordingFiles::kTruth;
    if (!options.live && options.yardstick.truth.empty() && options.yardstick.relations.empty() &&
        fs::exists(own)) {
        options.yardstick.truth = own;
        options.own_truth = true;
    }
}

void check_usage(const LocalizeOptions& options) {
    if (options.live != options.drive.empty()) {
        throw CLI::RequiredError("either DRIVE or --live");
    }
    if (options.out.empty() && options.publish.servers.empty()) {
        throw CLI::RequiredError("--out");
    }
    const RobotOptions& robot = options.robot;
    if (!options.live && (!robot.lidar.empty() || !robot.camera.empty() || robot.no_camera ||
                          !robot.clock.empty() || !options.publish.servers.empty())) {
        throw CLI::RequiresError("--lidar, --camera, --no-camera, --clock and --publish", "--live");
    }
    for (const std::string& server : options.publish.servers) {
        try {
            parse_endpoint(server);
        } catch (const Error& error) {
            throw CLI::ValidationError("--publish", error.what());
        }
    }
    check_start_options(options.start);
}

}  // namespace

void add_localize_command(CLI::App& program, Action& action) {
    const auto options = std::make_shared<LocalizeOptions>();
    CLI::App* command =
        program.add_subcommand("localize", "Find and keep the place in a stored map along a drive");
    command->add_option("MAP", options->map, "Folder of a map, or .yaml file of a map_server map")
        ->required()
        ->type_name("");
    command
        ->add_option("DRIVE", options->drive, "Folder of a recording, or CARMEN log (plain or .gz)")
        ->type_name("");
    command->add_flag("--live", options->live, "What the robot's devices say now, until Ctrl-C");
    add_robot_options(*command, options->robot);
    command
        ->add_option(
            "-o,--out", options->out,
            "Folder of the run; a run in it is replaced. With --publish it may be left out: "
            "then nothing is kept but the last pose, in what --resume names")
        ->type_name("DIR");
    add_start_options(*command, options->start);
    command
        ->add_option("--publish", options->publish.servers,
                     "Send each pose to this 'hybrid-slam drive'; as often as there are drives")
        ->allow_extra_args(false)
        ->type_name("tcp://HOST:PORT");
    command
        ->add_option("--name", options->publish.name,
                     "By which drives know this source (their pilot.pose_source)")
        ->type_name("TEXT");
    add_token_option(*command, options->publish.token);
    add_clock_option(*command, options->robot.clock);
    add_yardstick_options(*command, options->yardstick, 0);
    command
        ->add_option("--map-truth", options->map_truth,
                     "True trajectory (TUM) of the drive that the map was made from: then no "
                     "alignment hides an error")
        ->type_name("FILE");
    add_config_option(*command, options->config);
    add_set_option(*command, options->overrides, "tracking.window=20");
    add_common_options(*command, options->common);
    command->footer(kFooter);
    command->callback([options, &action] {
        check_usage(*options);
        take_own_truth(*options);
        action = [options] { return run_localize(*options); };
    });
}

}  // namespace hybrid_slam::tools
