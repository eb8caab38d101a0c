// SPDX-License-Identifier: Apache-2.0
#include "pose_publisher.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <utility>

#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/vehicle/corridor.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

/// How sure somebody is who says where the vehicle stands.
constexpr double kToldPosition = 0.5;           ///< metres
constexpr double kToldHeading = radians(10.0);  ///< radians

LinkPoseStatus status_of(const LocalizationResult& result, bool known) {
    if (result.status == LocalizationStatus::kLost) {
        return LinkPoseStatus::kLost;
    }
    if (!known || !result.map_from_robot) {
        return LinkPoseStatus::kRelocalizing;
    }
    return result.status == LocalizationStatus::kDegraded ? LinkPoseStatus::kDegraded
                                                          : LinkPoseStatus::kTracking;
}

}  // namespace

void add_token_option(CLI::App& command, std::string& token) {
    command
        .add_option("--token", token,
                    "Shared secret, when the server has one; better in HYBRID_SLAM_TOKEN, which no "
                    "list of processes shows")
        ->envname("HYBRID_SLAM_TOKEN")
        ->type_name("WORD");
}

PosePublisher::PosePublisher(const PublishOptions& options, Setup setup)
    : setup_(std::move(setup)), surroundings_(setup_.surroundings) {
    for (const std::string& address : options.servers) {
        LinkClientConfig config;
        config.server = address;
        config.token = options.token;
        config.name = options.name;
        Server server;
        server.name = address;
        server.client = std::make_unique<LinkClient>(config, LinkRole::kPose);
        servers_.push_back(std::move(server));
    }
}

void PosePublisher::listen(Server& server, double patience) {
    for (const ServerMessage& message : server.client->received(patience)) {
        if (const auto* const status = std::get_if<LinkStatus>(&message)) {
            server.steering = status->steering;
            server.answered = status->pose_stamp;
        } else if (const auto* const pose = std::get_if<LinkInitialPose>(&message)) {
            asked_ = pose->map_from_robot;
        }
    }
    tell_news(server);
}

void PosePublisher::wait_for_answer(Server& server) {
    constexpr double kPatience = 5.0;  // seconds, of the wall clock
    const Stopwatch clock;
    while (sent_ && server.answered != *sent_ && clock.seconds() < kPatience &&
           server.client->wait_connected(kPatience)) {
        listen(server, 0.1);
    }
}

void PosePublisher::tell_news(Server& server) {
    const LinkClientReport report = server.client->report();
    const bool is_up = report.state == LinkState::kConnected;
    const bool was_up = server.said == LinkState::kConnected;
    if (is_up && !was_up) {
        server.steering = 0.0;  // what it said before may be long ago
        print_info("publishing to " + server.name);
    } else if (!is_up && report.state == LinkState::kWaiting &&
               (was_up || report.trouble != server.trouble)) {
        print_warning("not publishing: " + report.trouble);
    }
    if (report.state != LinkState::kConnecting) {
        server.said = report.state;
        server.trouble = report.trouble;
    }
}

void PosePublisher::before(Localizer& localizer) {
    for (Server& server : servers_) {
        listen(server);
        if (setup_.lockstep) {
            wait_for_answer(server);
        }
    }
    if (asked_) {
        print_info(fmt::format("told to begin at {:.2f}, {:.2f}, {:.0f} deg", asked_->x(),
                               asked_->y(), degrees(asked_->heading)));
        const Eigen::Vector3d variances(kToldPosition * kToldPosition,
                                        kToldPosition * kToldPosition, kToldHeading * kToldHeading);
        localizer.start_at(*asked_, variances.asDiagonal());
        asked_.reset();
    }
}

void PosePublisher::look_around(const Frame& frame, const LocalizationResult& result) {
    if (result.jump) {
        surroundings_.correct(result.jump->to * result.jump->from.inverse());
    }
    surroundings_.see(frame.scan, *result.map_from_robot);
}

LinkPose PosePublisher::pose_of(const Frame& frame, const LocalizationResult& result,
                                bool known) const {
    LinkPose pose;
    pose.stamp = result.stamp;
    pose.map = setup_.identity;
    pose.status = status_of(result, known);
    pose.score = std::clamp(result.score, 0.0, 1.0);
    pose.is_protective = frame.scan.has(kProtectiveField);
    if (pose.is_known()) {
        pose.map_from_robot = *result.map_from_robot;
        pose.covariance = result.covariance;
    }
    return pose;
}

void PosePublisher::look_along(double steering, const Points& obstacles, LinkPose& pose) const {
    Corridor corridor;
    corridor.steering = steering;
    corridor.margin = setup_.surroundings.margin;
    corridor.most = setup_.surroundings.reach;
    pose.clear_ahead = free_way(setup_.vehicle, corridor, obstacles);
    corridor.direction = -1;
    if (setup_.surroundings.trust_blind_area || surroundings_.sees_behind(setup_.vehicle)) {
        pose.clear_behind = free_way(setup_.vehicle, corridor, obstacles);
    }
}

void PosePublisher::after(const Frame& frame, const LocalizationResult& result, bool known) {
    LinkPose pose = pose_of(frame, result, known);
    Points obstacles;
    // While it is not known, what was seen stays where it is in the map: one scan that fits badly
    // must not free what is behind the vehicle.
    if (pose.is_known()) {
        look_around(frame, result);
        obstacles = surroundings_.obstacles(setup_.map->grid());
    }
    for (const Server& server : servers_) {
        if (pose.is_known()) {
            look_along(server.steering, obstacles, pose);
        }
        pose.age = std::max(0.0, setup_.now() - result.stamp);
        if (setup_.lockstep && !sent_) {
            server.client->wait_connected(10.0);  // else the first pose would be lost
        }
        server.client->send(pose);
    }
    sent_ = result.stamp;
}

nlohmann::ordered_json PosePublisher::counts() const {
    nlohmann::ordered_json all = nlohmann::ordered_json::array();
    for (const Server& server : servers_) {
        const LinkClientReport report = server.client->report();
        all.push_back({{"server", server.name},
                       {"connections", report.connections},
                       {"sent", report.sent},
                       {"replaced", report.poses_replaced},
                       {"stale", report.poses_stale},
                       {"invalid", report.poses_invalid},
                       {"refused", report.refusals}});
    }
    return all;
}

}  // namespace hybrid_slam::tools
