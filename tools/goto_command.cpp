// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <sstream>

#include "commands.hpp"
#include "drive_visit.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/io/endpoint.hpp"
#include "interrupt.hpp"
#include "pose_publisher.hpp"

namespace hybrid_slam::tools {
namespace {

struct GotoOptions {
    CommonOptions common;
    std::string server;
    std::vector<std::string> places;
    std::string here;
    std::string token;
    bool append = false;
    bool watch = false;
    double timeout = 5.0;               ///< seconds
    std::vector<LinkCommand> commands;  ///< one at most
};

constexpr auto kFooter =
    R"(Places are in the map, of the middle of the vehicle's fixed axle; all but the last are passed, at the last one it
stops. A third number is the heading there in degrees. Without --append they come instead of those that wait.
A command is done when the drive's status shows it. Without places and commands it shows what the vehicle does, until
Ctrl-C. A pause is ended by --resume alone, not by other places.
Exit codes: 0 taken, or done; with --watch: arrived; 1 refused, not confirmed, not reachable, ended before;
            2 wrong usage; 3 interrupted while watching: the vehicle drives on (--cancel stops it).
Examples:
  hybrid-slam goto truck:5000 1.30,-0.15 -2.40,-1.60 --watch
  hybrid-slam goto truck:5000 3,1.5,90 --append
  hybrid-slam goto truck:5000 --pause
  hybrid-slam goto truck:5000 --here 1.2,0.4,180     # tells a SLAM that is lost where it is
)";

std::vector<double> numbers_of(const std::string& text) {
    std::vector<double> numbers;
    std::stringstream stream(text);
    std::string word;
    while (std::getline(stream, word, ',')) {
        std::size_t used = 0;
        double number = NAN;
        try {
            number = std::stod(word, &used);
        } catch (const std::exception&) {
            used = 0;
        }
        if (used != word.size() || word.empty() || !std::isfinite(number)) {
            throw CLI::ValidationError(text, "must be X,Y or X,Y,HEADING");
        }
        numbers.push_back(number);
    }
    return numbers;
}

LinkWaypoint waypoint_of(const std::string& text) {
    const std::vector<double> numbers = numbers_of(text);
    if (numbers.size() < 2 || numbers.size() > 3 || text.back() == ',') {
        throw CLI::ValidationError(text, "must be X,Y or X,Y,HEADING");
    }
    LinkWaypoint waypoint;
    waypoint.place = {numbers[0], numbers[1]};
    if (numbers.size() == 3) {
        waypoint.heading = normalize_angle(radians(numbers[2]));
    }
    return waypoint;
}

LinkInitialPose pose_of(const std::string& text) {
    const std::vector<double> numbers = numbers_of(text);
    if (numbers.size() != 3 || text.back() == ',') {
        throw CLI::ValidationError("--here", "must be X,Y,HEADING");
    }
    return {{numbers[0], numbers[1], normalize_angle(radians(numbers[2]))}};
}

LinkGoals goals_of(const GotoOptions& options) {
    LinkGoals goals;
    for (const std::string& place : options.places) {
        goals.waypoints.push_back(waypoint_of(place));
    }
    goals.append = options.append;
    // So that the status tells this order from those of others.
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    goals.id =
        fmt::format("goto-{}", std::chrono::duration_cast<std::chrono::microseconds>(now).count());
    return goals;
}

int run_goto(const GotoOptions& options) {
    DriveErrand errand;
    errand.server = options.server;
    errand.token = options.token;
    if (!options.here.empty()) {
        errand.here = pose_of(options.here);
    }
    errand.commands = options.commands;
    if (!options.places.empty()) {
        errand.goals = goals_of(options);
    }
    errand.watches = options.watch;
    errand.patience = options.timeout;
    errand.quiet = options.common.quiet;
    errand.json = options.common.json;
    catch_interrupts();
    return visit_drive(errand);
}

void check_usage(const GotoOptions& options) {
    try {
        parse_endpoint(options.server);
    } catch (const Error& error) {
        throw CLI::ValidationError("SERVER", error.what());
    }
    for (const std::string& place : options.places) {
        waypoint_of(place);
    }
    if (!options.here.empty()) {
        pose_of(options.here);
    }
    if (options.append && options.places.empty()) {
        throw CLI::RequiresError("--append", "places");
    }
    const std::size_t things =
        options.commands.size() + (options.here.empty() ? 0 : 1) + (options.places.empty() ? 0 : 1);
    const bool may_go_together = options.commands.size() == 1 && options.here.empty() &&
                                 (options.commands[0] == LinkCommand::kAutomatic ||
                                  options.commands[0] == LinkCommand::kResume);
    if (things > 1 && !may_go_together) {
        throw CLI::ValidationError(
            "one command or places, please; with places only --resume or "
            "--automatic");
    }
}

void add_command_flag(CLI::App& command, const std::shared_ptr<GotoOptions>& options,
                      const char* name, LinkCommand what, const char* help) {
    command.add_flag_callback(
        name, [options, what] { options->commands.push_back(what); }, help);
}

}  // namespace

void add_goto_command(CLI::App& program, Action& action) {
    const auto options = std::make_shared<GotoOptions>();
    CLI::App* command = program.add_subcommand(
        "goto", "Send a vehicle that 'drive' drives to places, or watch what it does");
    command->add_option("SERVER", options->server, "Where the drive listens: truck:5000")
        ->required()
        ->type_name("");
    command->add_option("PLACES", options->places, "X,Y or X,Y,HEADING each: metres, degrees")
        ->type_name("");
    command->add_flag("--append", options->append, "Behind the places that wait");
    command->add_flag("--watch", options->watch, "Show what it does until it has arrived there");
    add_command_flag(*command, options, "--cancel", LinkCommand::kCancel,
                     "Stop, forget the places");
    add_command_flag(*command, options, "--pause", LinkCommand::kPause, "Stop, keep the places");
    add_command_flag(*command, options, "--resume", LinkCommand::kResume,
                     "Go on, after a pause or a fault of the drive");
    add_command_flag(*command, options, "--manual", LinkCommand::kManual,
                     "Stop and leave the vehicle to who drives it by hand");
    add_command_flag(*command, options, "--automatic", LinkCommand::kAutomatic,
                     "Take it over again");
    command->add_option("--here", options->here, "Where the vehicle stands, for SLAM to begin at")
        ->type_name("X,Y,HEADING");
    command->add_option("--timeout", options->timeout, "s until the drive must have answered (5)")
        ->check(CLI::Range(0.1, 3600.0))
        ->type_name("S");
    add_token_option(*command, options->token);
    add_common_options(*command, options->common);
    command->footer(kFooter);
    command->callback([options, &action] {
        check_usage(*options);
        action = [options] { return run_goto(*options); };
    });
}

}  // namespace hybrid_slam::tools
