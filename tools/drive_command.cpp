// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "drive_session.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/io/endpoint.hpp"
#include "input.hpp"
#include "interrupt.hpp"
#include "live_input.hpp"
#include "messages.hpp"
#include "pose_publisher.hpp"
#include "stored_map.hpp"

namespace hybrid_slam::tools {
namespace {

namespace fs = std::filesystem;

struct DriveOptions {
    CommonOptions common;
    std::string listen;
    std::string token;
    std::string can;
    fs::path vehicle;
    fs::path map;
    fs::path out;
    fs::path config;
    Overrides overrides;
    std::string broker;
    std::string clock;
    bool manual = false;
};

constexpr auto kFooter =
    R"(Runs on the vehicle's computer: listens for poses of 'hybrid-slam localize --publish' and for places of
'hybrid-slam goto' (docs/link.md), plans ways in the map that the vehicle can drive, and drives it over CAN.
This is navigation, not a safety function: the scanner's own safety outputs stay wired to the truck's brakes.
It stops when poses end, come late, are lost, uncertain, of another map or do not follow the wheels; before what is
in the way; when the scanner's protective field is broken; at a fault of the drive or its bus, which has to be ended
with 'goto --resume'; and at Ctrl-C.
Ports of --can: can0 (SocketCAN), slcan:/dev/ttyACM0 (a serial adapter), candump:FILE (a dry run: what would be sent).
Who listens beyond this computer (--listen 0.0.0.0:5000) should have a token. A broker (--mqtt) makes it a vehicle of a
VDA 5050 fleet (docs/vda5050.md).
Files of --out: driven.csv (time, place, commands), events.jsonl, drive.png (planned and driven ways), summary.json
Exit codes: 0 ended by Ctrl-C or SIGTERM; 1 it cannot begin; 2 wrong usage.
Examples:
  hybrid-slam drive --map hall/ --can candump:dry.log
  hybrid-slam drive --listen :5000 --can can0 --vehicle config/robots/forklift.yaml --map hall/
  hybrid-slam drive --listen 0.0.0.0:5000 --vehicle forklift.yaml --map hall/ --mqtt tcp://broker:1883
)";

RobotConfig vehicle_of(const DriveOptions& options) {
    RobotConfig robot = options.vehicle.empty() ? RobotConfig() : read_robot(options.vehicle);
    if (!options.can.empty()) {
        robot.can.bus.port = options.can;
    }
    return robot;
}

DriveSettings settings_of(const DriveOptions& options) {
    DriveSettings settings = load_drive_settings(options.config, options.overrides);
    if (!options.listen.empty()) {
        settings.link.listen = options.listen;
    }
    if (!options.token.empty()) {
        settings.link.token = options.token;
    }
    if (!options.broker.empty()) {
        settings.fleet.broker = options.broker;
    }
    if (!options.clock.empty()) {
        settings.link.lines_per_second = 10000;  // scans of a minute come within a second there
    }
    settings.pilot.starts_automatic = settings.pilot.starts_automatic && !options.manual;
    return settings;
}

int run_drive(const DriveOptions& options) {
    catch_interrupts(2);  // a second signal must not overtake the stop that the first is to bring
    DriveSetup setup;
    setup.robot = vehicle_of(options);
    setup.settings = settings_of(options);
    setup.map = open_reference_map(options.map);
    setup.map_name = name_of(options.map);
    setup.out = options.out;
    setup.clock = options.clock;
    setup.quiet = options.common.quiet;
    const std::string host = parse_endpoint(setup.settings.link.listen).host;
    if (host != "127.0.0.1" && host != "::1" && host != "localhost" &&
        setup.settings.link.token.empty()) {
        print_warning("whoever reaches " + setup.settings.link.listen +
                      " can drive the vehicle: no token is asked for (--token)");
    }
    DriveSession session(std::move(setup));
    const nlohmann::ordered_json summary = session.run();
    if (options.common.json) {
        print_json(summary);
    } else if (!options.out.empty()) {
        print_result(fmt::format(
            "{:.1f} m driven, {}\ndrive      {}", summary["path_m"].get<double>(),
            counted(summary["arrivals"].get<std::size_t>(), "arrival"), options.out.string()));
    }
    return kOk;
}

void check_usage(const DriveOptions& options) {
    if (!options.listen.empty()) {
        try {
            parse_endpoint(options.listen);
        } catch (const Error& error) {
            throw CLI::ValidationError("--listen", error.what());
        }
    }
}

}  // namespace

void add_drive_command(CLI::App& program, Action& action) {
    const auto options = std::make_shared<DriveOptions>();
    CLI::App* command = program.add_subcommand(
        "drive", "Take poses and places to go to, and drive the vehicle there over CAN");
    command->add_option("--map", options->map, "Folder of a map, or .yaml file of a map_server map")
        ->required()
        ->type_name("MAP");
    command
        ->add_option("--vehicle", options->vehicle,
                     "Robot (YAML) with sections vehicle and can, see config/robots")
        ->type_name("FILE");
    command->add_option("--can", options->can, "Port of the CAN bus (robot's can.port)")
        ->type_name("PORT");
    command
        ->add_option("--listen", options->listen,
                     "Where to listen (:5000, which only this computer reaches)")
        ->type_name("[HOST]:PORT");
    add_token_option(*command, options->token);
    command->add_option("--mqtt", options->broker, "Broker of a VDA 5050 fleet (fleet.broker)")
        ->type_name("tcp://HOST:PORT");
    command->add_flag("--manual", options->manual,
                      "Begin in manual mode: nothing is sent until 'goto --automatic'");
    command->add_option("-o,--out", options->out, "Folder for what was driven")->type_name("DIR");
    add_clock_option(*command, options->clock);
    add_config_option(*command, options->config, "; config/drive.yaml has all keys");
    add_set_option(*command, options->overrides, "follower.speed_limit=0.2");
    add_common_options(*command, options->common);
    command->footer(kFooter);
    command->callback([options, &action] {
        check_usage(*options);
        action = [options] { return run_drive(*options); };
    });
}

}  // namespace hybrid_slam::tools
