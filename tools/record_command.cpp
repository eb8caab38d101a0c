// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "hybrid_slam/core/error.hpp"
#include "interrupt.hpp"
#include "live_input.hpp"
#include "messages.hpp"
#include "recorder.hpp"
#include "settings.hpp"

namespace hybrid_slam::tools {
namespace {

struct RecordOptions {
    CommonOptions common;
    RobotOptions robot;
    Overrides overrides;
    std::filesystem::path out;
    double duration = 0.0;
};

constexpr auto kFooter =
    R"(Records until Ctrl-C, SIGTERM, the end of --duration, or the end of a lidar that is a file. Devices may be switched
on later, and come and go: they are opened again and again, with a message for each change. What came is on the
disk after a second at most. Images are dropped before scans when the disk is slow or nearly full.
Files of the recording: lidar.rec (the scanner's bytes as they came), camera.rec (the images as they came),
  robot.yaml (the robot as configured here), manifest.json.
Examples:
  hybrid-slam record --lidar /dev/ttyUSB0 --camera /dev/video0 --robot config/robots/forklift.yaml --out drive1
  hybrid-slam record --lidar tcp://192.168.1.20:4001 --no-camera --out drive2 --duration 600
  hybrid-slam record --robot config/robots/forklift.yaml --set lidar.baud=115200 --out drive3
  hybrid-slam info drive1                # fit for mapping?
  hybrid-slam map drive1 --out hall
Exit codes: 0 recorded, ended by Ctrl-C or SIGTERM too; 1 no scan was recorded, or the disk failed (what was
            recorded before stays); 2 wrong usage.
)";

RobotConfig configured_robot(const RecordOptions& options) {
    RobotConfig robot = robot_of(options.robot);
    ConfigSchema schema;
    describe(schema, robot);
    override_with(schema, options.overrides);
    const LidarReader checked(robot.lidar);  // before the folder is made
    return robot;
}

/// So that the same command can be given again once the scanner is plugged in.
void remove_empty(const std::filesystem::path& folder) {
    std::error_code ignored;
    for (const char* name :
         {RecordingFiles::kManifest, RecordingFiles::kRobot, RecordingFiles::kLidar}) {
        std::filesystem::remove(folder / name, ignored);
    }
    std::filesystem::remove(folder, ignored);
}

RecordingSummary record(const RecordOptions& options) {
    Recorder recorder(options.out, configured_robot(options), options.common.quiet);
    return recorder.run(options.duration);
}

std::string why_no_scans(const RecordingSummary& summary) {
    const std::string& detail = summary.devices.lidar.detail;
    return detail.empty() ? "the lidar's telegrams held none" : detail;
}

int run_record(const RecordOptions& options) {
    catch_interrupts();
    const RecordingSummary summary = record(options);
    const bool empty = summary.written.lidar_chunks + summary.written.images == 0;
    if (empty && summary.failure.empty()) {
        remove_empty(options.out);
        throw Error("nothing was recorded: " + why_no_scans(summary));
    }
    if (options.common.json) {
        print_json(summary.json());
    } else {
        print_result(summary.text());
    }
    if (!summary.failure.empty()) {
        throw Error(summary.failure);
    }
    if (summary.counts.lidar.scans == 0) {
        throw Error("no scan was recorded: " + why_no_scans(summary));
    }
    return kOk;
}

}  // namespace

void add_record_command(CLI::App& program, Action& action) {
    const auto options = std::make_shared<RecordOptions>();
    CLI::App* command =
        program.add_subcommand("record", "Record what a lidar and a camera say, as it comes");
    add_robot_options(*command, options->robot);
    command->add_option("-o,--out", options->out, "Folder to make for the recording")
        ->required()
        ->type_name("DIR");
    command->add_option("--duration", options->duration, "Stop after so many seconds")
        ->check(CLI::Range(0.01, 1e9).description(""))
        ->type_name("S");
    add_set_option(*command, options->overrides, "lidar.baud=115200, a key of the robot");
    add_common_options(*command, options->common);
    command->footer(kFooter);
    command->callback([options, &action] { action = [options] { return run_record(*options); }; });
}

}  // namespace hybrid_slam::tools
