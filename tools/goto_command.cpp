// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "commands.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/link/endpoint.hpp"
#include "hybrid_slam/link/link_client.hpp"
#include "interrupt.hpp"
#include "messages.hpp"
#include "pose_publisher.hpp"
#include "recorder.hpp"

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

constexpr double kSettling = 1.0;  ///< seconds in which a refusal would come

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

nlohmann::ordered_json to_json(const LinkStatus& status) {
    nlohmann::ordered_json json = {{"mode", to_string(status.mode)},
                                   {"state", to_string(status.state)},
                                   {"reason", status.reason},
                                   {"fault", status.fault},
                                   {"goals", status.goals},
                                   {"waypoints_left", status.waypoints_left},
                                   {"remaining_m", rounded(status.remaining)}};
    if (status.map_from_robot) {
        const Pose2d& pose = *status.map_from_robot;
        json["pose"] = {{"x_m", rounded(pose.x())},
                        {"y_m", rounded(pose.y())},
                        {"heading_deg", rounded(degrees(pose.heading))},
                        {"age_s", rounded(status.pose_age)}};
    }
    return json;
}

/// One conversation with a drive.
class Visit {
  public:
    explicit Visit(const GotoOptions& options) : options_(options), line_(options.common.quiet) {
        LinkClientConfig config;
        config.server = options.server;
        config.token = options.token;
        config.name = "hybrid-slam goto";
        const bool only_looks =
            options.places.empty() && options.commands.empty() && options.here.empty();
        client_ =
            std::make_unique<LinkClient>(config, only_looks ? LinkRole::kWatch : LinkRole::kGoal);
        watches_ = options.watch || only_looks;
    }

    int run() {
        if (!connect()) {
            print_error("not connected: " + trouble());
            return kFailure;
        }
        send();
        if (!wait_until_taken()) {
            return interrupted() ? kInterrupted : kFailure;
        }
        return watches_ ? watch() : tell_result(true);
    }

  private:
    bool connect() {
        const Stopwatch clock;
        while (!interrupted() && clock.seconds() < options_.timeout) {
            if (client_->wait_connected(0.1)) {
                return true;
            }
            // A server that says no will not change its mind.
            if (client_->report().refusals > 0) {
                return false;
            }
        }
        return false;
    }

    std::string trouble() const {
        const LinkClientReport report = client_->report();
        return report.trouble.empty() ? options_.server + ": no answer" : report.trouble;
    }

    void send() {
        bool sent = true;
        if (!options_.here.empty()) {
            sent = client_->send(pose_of(options_.here));
        }
        for (const LinkCommand command : options_.commands) {
            sent = sent && client_->send(command);
        }
        if (!options_.places.empty()) {
            const LinkGoals goals = goals_of(options_);
            id_ = goals.id;
            sent = sent && client_->send(goals);
        }
        if (!sent) {
            throw Error(options_.server + ": the connection is gone");
        }
        orders_ = options_.commands.size() + (options_.here.empty() ? 0 : 1) +
                  (options_.places.empty() ? 0 : 1);
    }

    /// Whether a status shows that what was sent has come about. One from before never does: a
    /// command that changes nothing would, and is told so at once.
    bool is_done(const LinkStatus& status) const {
        bool done = id_.empty() || status.goals == id_;
        const bool is_paused = status.state == LinkDriveState::kPaused;
        for (const LinkCommand command : options_.commands) {
            switch (command) {
                case LinkCommand::kCancel:
                    done = done && (!id_.empty() || status.waypoints_left == 0);
                    break;
                case LinkCommand::kPause:
                    done = done && (is_paused || status.mode == LinkMode::kManual ||
                                    status.state == LinkDriveState::kFault);
                    break;
                case LinkCommand::kResume:
                    done = done && !is_paused;
                    break;
                case LinkCommand::kManual:
                    done = done && status.mode == LinkMode::kManual;
                    break;
                case LinkCommand::kAutomatic:
                    done = done && status.mode == LinkMode::kAutomatic;
                    break;
            }
        }
        return done && is_on_its_way();
    }

    /// All that was to be sent has been given to the network.
    bool is_on_its_way() const { return client_->report().sent >= orders_; }

    /// The next status; empty after a while, or when something was refused.
    void listen(double seconds) {
        for (const ServerMessage& message : client_->received(seconds)) {
            if (const auto* const status = std::get_if<LinkStatus>(&message)) {
                status_ = *status;
                is_taken_ = is_done(*status);
            } else if (const auto* const refusal = std::get_if<LinkRefusal>(&message)) {
                refusal_ = refusal->reason;
            }
        }
    }

    /// Whether what was sent is being done; a refusal takes a moment to come.
    bool wait_until_taken() {
        const Stopwatch clock;
        double taken_at = -1.0;
        while (!interrupted()) {
            listen(0.05);
            if (!refusal_.empty()) {
                line_.clear();
                print_error("refused: " + refusal_);
                return false;
            }
            if (is_taken_ && status_) {
                taken_at = taken_at < 0.0 ? clock.seconds() : taken_at;
                const bool is_under_way =
                    !id_.empty() && status_->state == LinkDriveState::kDriving;
                if (watches_ || is_under_way || clock.seconds() - taken_at > kSettling) {
                    return true;
                }
            } else {
                taken_at = -1.0;  // what seemed to be done was an earlier state of things
            }
            if (clock.seconds() > options_.timeout) {
                print_error(options_.server + ": does not confirm what was sent");
                return false;
            }
        }
        return false;
    }

    bool is_over() const {
        if (id_.empty()) {
            return false;  // watches for ever
        }
        return status_->goals != id_ || status_->state == LinkDriveState::kArrived ||
               (status_->state == LinkDriveState::kIdle && status_->waypoints_left == 0);
    }

    int watch() {
        bool was_connected = true;
        while (!interrupted()) {
            listen(0.2);
            show();
            if (!refusal_.empty()) {
                line_.clear();
                print_error("refused: " + refusal_);
                return kFailure;
            }
            const bool is_connected = client_->report().state == LinkState::kConnected;
            if (is_connected != was_connected) {
                line_.clear();
                print_warning(is_connected ? "connected again"
                                           : "the connection is gone: " + trouble());
                was_connected = is_connected;
            }
            if (is_connected && is_over()) {
                line_.clear();
                return tell_result(status_->goals == id_ &&
                                   status_->state == LinkDriveState::kArrived);
            }
        }
        line_.clear();
        return kInterrupted;
    }

    std::string text() const {
        std::string text(to_string(status_->state));
        const std::string& why = status_->fault.empty() ? status_->reason : status_->fault;
        text += why.empty() ? "" : " (" + why + ")";
        if (status_->map_from_robot) {
            const Pose2d& pose = *status_->map_from_robot;
            text += fmt::format(" at {:.2f}, {:.2f}, {:.0f} deg", pose.x(), pose.y(),
                                degrees(pose.heading));
        }
        if (status_->waypoints_left > 0) {
            text +=
                fmt::format("; {:.2f} m/s, {} left, {:.1f} m", status_->speed,
                            counted(static_cast<std::size_t>(status_->waypoints_left), "waypoint"),
                            status_->remaining);
        }
        return text;
    }

    void show() {
        if (!status_) {
            return;
        }
        const std::string news = std::string(to_string(status_->state)) + status_->reason +
                                 status_->fault + std::to_string(status_->waypoints_left);
        if (news != shown_) {
            shown_ = news;
            line_.clear();
            print_info(text());
        } else if (line_.visible()) {
            line_.draw(text());
        }
    }

    int tell_result(bool good) const {
        if (options_.common.json) {
            print_json(to_json(*status_));
        } else {
            print_result(text());
        }
        return good ? kOk : kFailure;
    }

    const GotoOptions& options_;
    StatusLine line_;
    std::unique_ptr<LinkClient> client_;
    bool watches_ = false;
    std::string id_;
    std::size_t orders_ = 0;  ///< lines that were sent
    bool is_taken_ = false;
    std::optional<LinkStatus> status_;
    std::string refusal_;
    std::string shown_;
};

int run_goto(const GotoOptions& options) {
    catch_interrupts();
    return Visit(options).run();
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
