// SPDX-License-Identifier: Apache-2.0
#include "drive_log.hpp"

#include <fmt/format.h>

#include "drive_picture.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr auto kFormat = "hybrid_slam drive";
constexpr double kRowEvery = 0.1;           ///< seconds
constexpr double kFlushEvery = 1.0;         ///< seconds
constexpr std::size_t kMostPoses = 200000;  ///< for the picture: hours of driving
constexpr std::size_t kMostRoutes = 1000;
constexpr auto kHeader =
    "time,state,x_m,y_m,heading_deg,pose_age_s,speed_m_s,steering_deg,command_speed_m_s,"
    "command_steering_deg,remaining_m,waypoints_left";

void expect_usable(const fs::path& folder) {
    if (!fs::exists(folder) || (fs::is_directory(folder) && fs::is_empty(folder))) {
        return;
    }
    const fs::path summary = folder / DriveFiles::kSummary;
    constexpr std::size_t kMost = std::size_t{1} << 24U;
    const auto json = fs::is_regular_file(summary)
                          ? nlohmann::json::parse(read_whole_file(summary, kMost), nullptr, false)
                          : nlohmann::json();
    if (!json.is_object() || json.value("format", "") != kFormat) {
        throw Error(folder.string() + ": is not empty and not a drive, so it is left alone");
    }
}

}  // namespace

DriveLog::DriveLog(const fs::path& folder_or_empty) : folder_(folder_or_empty) {
    if (folder_.empty()) {
        return;
    }
    try {
        expect_usable(folder_);
        fs::create_directories(folder_);
    } catch (const fs::filesystem_error& error) {
        throw Error(folder_.string() + ": " + error.code().message());
    }
    write_text(folder_ / DriveFiles::kSummary,
               Json({{"format", kFormat}, {"finished", false}}).dump() + "\n");
    driven_.emplace(folder_ / DriveFiles::kDriven);
    driven_->add(kHeader);
    events_.emplace(folder_ / DriveFiles::kEvents);
}

void DriveLog::event(double now, const std::string& what, const Json& details) {
    if (!events_) {
        return;
    }
    Json line = {{"time", rounded(now)}, {"event", what}};
    line.update(details);
    try {
        events_->add(line.dump(-1, ' ', false, Json::error_handler_t::replace));
    } catch (const Error& error) {
        give_up(error);
    }
}

/// A disk that is full must not stop a vehicle, nor leave it without its driver.
void DriveLog::give_up(const Error& error) {
    print_warning(std::string(error.what()) + "; nothing more is written down");
    driven_.reset();
    events_.reset();
}

void DriveLog::look_at_status(double now, const LinkStatus& status) {
    if (any_ && status.state == last_.state && status.reason == last_.reason &&
        status.fault == last_.fault && status.mode == last_.mode) {
        return;
    }
    const bool moved_before = any_ && last_.state == LinkDriveState::kDriving;
    if (moved_before && status.state != LinkDriveState::kDriving) {
        arrivals_ += status.state == LinkDriveState::kArrived ? 1 : 0;
        stops_ += status.state == LinkDriveState::kStopped && !status.reason.empty() ? 1 : 0;
        if (last_pose_ && events_) {
            (status.state == LinkDriveState::kArrived ? stood_ : interrupted_)
                .push_back(*last_pose_);
        }
    }
    event(now, "status",
          {{"mode", to_string(status.mode)},
           {"state", to_string(status.state)},
           {"reason", status.reason},
           {"fault", status.fault},
           {"goals", status.goals}});
    last_ = status;
    any_ = true;
}

void DriveLog::keep_route(const Route* route) {
    if (route != nullptr && !had_route_ && events_ && routes_.size() < kMostRoutes) {
        routes_.push_back(*route);
        if (stood_.empty() && !route->points.empty()) {
            stood_.push_back(route->points.front().map_from_robot);
        }
    }
    had_route_ = route != nullptr;
}

void DriveLog::look(double now, const PilotOutput& output, const std::optional<LinkPose>& pose,
                    const Route* route) {
    try {
        write(now, output, pose, route);
    } catch (const Error& error) {
        give_up(error);
    }
}

void DriveLog::write(double now, const PilotOutput& output, const std::optional<LinkPose>& pose,
                     const Route* route) {
    keep_route(route);
    look_at_status(now, output.status);
    if (pose && pose->is_known() && pose->stamp != pose_stamp_) {
        pose_stamp_ = pose->stamp;
        last_pose_ = pose->map_from_robot;
        add_way(route != nullptr);
        if (events_ && route != nullptr && poses_.size() < kMostPoses) {
            poses_.push_back({pose->stamp, pose->map_from_robot});
        }
    }
    const LinkStatus& status = output.status;
    if (driven_ && now >= next_row_ && (route != nullptr || status.speed != 0.0)) {
        next_row_ = now + kRowEvery;
        const Pose2d at = status.map_from_robot.value_or(Pose2d());
        const DriveCommand command = output.command.value_or(DriveCommand());
        driven_->add(
            fmt::format("{:.3f},{},{:.4f},{:.4f},{:.3f},{:.3f},{:.4f},{:.2f},{:.4f},"
                        "{:.2f},{:.3f},{}",
                        now, to_string(status.state), at.x(), at.y(), degrees(at.heading),
                        status.pose_age, status.speed, degrees(status.steering), command.speed,
                        degrees(command.steering), status.remaining, status.waypoints_left));
    }
    if (now >= next_flush_) {
        next_flush_ = now + kFlushEvery;
        flush();
    }
}

/// In steps that are longer than a pose's noise.
void DriveLog::add_way(bool drives) {
    constexpr double kStep = 0.05;  // metres
    if (!drives || !way_from_) {
        way_from_ = last_pose_;
        return;
    }
    const double step = between(*way_from_, *last_pose_).translation.norm();
    if (step > kStep) {
        path_ += step;
        way_from_ = last_pose_;
    }
}

void DriveLog::flush() {
    if (driven_) {
        driven_->flush();
        events_->flush();
    }
}

Json DriveLog::finish(const Ending& ending) {
    Json summary = {{"format", kFormat},
                    {"finished", true},
                    {"program", "hybrid-slam " HYBRID_SLAM_VERSION},
                    {"path_m", rounded(path_)},
                    {"arrivals", arrivals_},
                    {"stops", stops_}};
    summary.update(ending.counts);
    if (events_) {
        flush();
        const std::string subtitle =
            fmt::format("{:.1f} m driven, {}, {}", path_, counted(arrivals_, "arrival"),
                        counted(stops_, "stop"));
        draw(DrivePicture{ending.title, subtitle, ending.map, ending.vehicle, routes_, poses_,
                          stood_, interrupted_})
            .write_png(folder_ / DriveFiles::kPicture);
        replace_text(folder_ / DriveFiles::kSummary,
                     summary.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
    }
    return summary;
}

}  // namespace hybrid_slam::tools
