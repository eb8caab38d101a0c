// SPDX-License-Identifier: Apache-2.0
#include "drive_visit.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/link/link_client.hpp"
#include "interrupt.hpp"
#include "messages.hpp"
#include "recorder.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr double kSettling = 1.0;  ///< seconds in which a refusal would come

LinkClientConfig client_config_of(const DriveErrand& errand) {
    LinkClientConfig config;
    config.server = errand.server;
    config.token = errand.token;
    config.name = "hybrid-slam goto";
    return config;
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
    explicit Visit(const DriveErrand& errand)
        : errand_(errand),
          line_(errand.quiet),
          only_looks_(!errand.goals && errand.commands.empty() && !errand.here),
          client_(client_config_of(errand), only_looks_ ? LinkRole::kWatch : LinkRole::kGoal),
          watches_(errand.watches || only_looks_),
          id_(errand.goals ? errand.goals->id : "") {}

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
        while (!interrupted() && clock.seconds() < errand_.patience) {
            if (client_.wait_connected(0.1)) {
                return true;
            }
            // A server that says no will not change its mind.
            if (client_.report().refusals > 0) {
                return false;
            }
        }
        return false;
    }

    std::string trouble() const {
        const LinkClientReport report = client_.report();
        return report.trouble.empty() ? errand_.server + ": no answer" : report.trouble;
    }

    void send() {
        bool sent = true;
        if (errand_.here) {
            sent = client_.send(*errand_.here);
        }
        for (const LinkCommand command : errand_.commands) {
            sent = sent && client_.send(command);
        }
        if (errand_.goals) {
            sent = sent && client_.send(*errand_.goals);
        }
        if (!sent) {
            throw Error(errand_.server + ": the connection is gone");
        }
        lines_ = errand_.commands.size() + (errand_.here ? 1 : 0) + (errand_.goals ? 1 : 0);
    }

    /// Whether a status shows that what was sent has come about. Of a command that changes nothing
    /// one from before shows it too.
    bool is_done(const LinkStatus& status) const {
        bool done = id_.empty() || status.goals == id_;
        const bool is_paused = status.state == LinkDriveState::kPaused;
        for (const LinkCommand command : errand_.commands) {
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
    bool is_on_its_way() const { return client_.report().sent >= lines_; }

    /// The next status; empty after a while, or when something was refused.
    void listen(double seconds) {
        for (const ServerMessage& message : client_.received(seconds)) {
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
            if (clock.seconds() > errand_.patience) {
                print_error(errand_.server + ": does not confirm what was sent");
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
            const bool is_connected = client_.report().state == LinkState::kConnected;
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
        if (errand_.json) {
            print_json(to_json(*status_));
        } else {
            print_result(text());
        }
        return good ? kOk : kFailure;
    }

    const DriveErrand& errand_;
    StatusLine line_;
    bool only_looks_;
    LinkClient client_;
    bool watches_;
    std::string id_;         ///< of the places
    std::size_t lines_ = 0;  ///< lines that were sent
    bool is_taken_ = false;
    std::optional<LinkStatus> status_;
    std::string refusal_;
    std::string shown_;
};

}  // namespace

int visit_drive(const DriveErrand& errand) {
    return Visit(errand).run();
}

}  // namespace hybrid_slam::tools
