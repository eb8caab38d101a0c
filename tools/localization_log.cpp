// SPDX-License-Identifier: Apache-2.0
#include "localization_log.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "messages.hpp"
#include "place_report.hpp"

namespace hybrid_slam::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kSaveEvery = 1.0;  ///< seconds

constexpr auto kHeader =
    "stamp,status,x_m,y_m,heading_deg,sigma_x_m,sigma_y_m,sigma_heading_deg,rho_xy,rho_x_heading,"
    "rho_y_heading,score,points,explained,violated,unmapped,unknown,misfit_rms_m,weak_x,weak_y,"
    "prior,particles,verdict,places";

double correlation(const Eigen::Matrix3d& covariance, int a, int b) {
    const double scale = std::sqrt(covariance(a, a) * covariance(b, b));
    return scale > 0.0 ? covariance(a, b) / scale : 0.0;
}

/// Nine fields, each with a comma behind it; empty while the pose is not known.
std::string pose_fields(const LocalizationResult& result) {
    if (!result.map_from_robot) {
        return ",,,,,,,,,";
    }
    const Pose2d& pose = *result.map_from_robot;
    const Eigen::Matrix3d& covariance = result.covariance;
    const Eigen::Vector3d sigmas = sigmas_of(covariance);
    return fmt::format("{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.4f},{:.4f},{:.4f},", pose.x(),
                       pose.y(), degrees(pose.heading), sigmas.x(), sigmas.y(), sigmas.z(),
                       correlation(covariance, 0, 1), correlation(covariance, 0, 2),
                       correlation(covariance, 1, 2));
}

std::string fit_fields(const LocalizationResult& result) {
    const ScanFit& fit = result.fit;
    return fmt::format("{:.4f},{},{:.4f},{:.4f},{:.4f},{:.4f},{:.6f},{:.4f},{:.4f},", result.score,
                       fit.points, fit.explained, fit.violated, fit.unmapped, fit.unknown, fit.rms,
                       result.weak_direction.x(), result.weak_direction.y());
}

Json jump_json(const Jump& jump) {
    const Pose2d step = between(jump.from, jump.to);
    return {{"from", to_json(jump.from)},
            {"to", to_json(jump.to)},
            {"distance_m", rounded(step.translation.norm())},
            {"turn_deg", rounded(degrees(step.heading))}};
}

/// The places in short.
Json places_json(const Relocalization& relocalization) {
    Json places = Json::array();
    for (const Place& place : relocalization.places) {
        Json json = to_json(place.map_from_robot);
        json["score"] = rounded(place.fit.score);
        json["explained"] = rounded(place.fit.explained);
        json["share"] = rounded(place.share);
        places.push_back(std::move(json));
    }
    return {{"verdict", to_string(relocalization.verdict)},
            {"nodes", relocalization.nodes},
            {"places", std::move(places)}};
}

}  // namespace

LocalizationLog::LocalizationLog(const RunFolder* folder, Start start)
    : folder_(folder), start_(std::move(start)) {}

void LocalizationLog::begin() {
    folder_->begin(start_.keep_last_pose);
    write_text(*folder_ / RunFiles::kConfig, start_.config);
    poses_.emplace(*folder_ / RunFiles::kPoses);
    poses_->add(kHeader);
    events_.emplace(*folder_ / RunFiles::kEvents);
    events_->add(start_.event.dump(-1, ' ', false, Json::error_handler_t::replace));
}

void LocalizationLog::add(const LocalizationResult& result, bool sure) {
    if (keeps_run()) {
        if (!poses_) {
            begin();
        }
        add_row(result);
        add_events(result);
    }
    if (sure) {
        LastPose& last = start_.last_pose;
        last.stamp = result.stamp;
        last.map_from_robot = *result.map_from_robot;
        last.covariance = result.covariance;
        last.score = result.score;
        unsaved_ = true;
    }
    if (since_save_.seconds() >= kSaveEvery) {
        save();
    }
}

void LocalizationLog::save() {
    since_save_ = Stopwatch();
    if (poses_) {
        poses_->flush();
        events_->flush();
    }
    if (unsaved_ && !start_.last_pose_file.empty()) {
        write_last_pose(start_.last_pose_file, start_.last_pose);
        unsaved_ = false;
    }
}

void LocalizationLog::add_row(const LocalizationResult& result) {
    const auto& relocalization = result.relocalization;
    poses_->add(fmt::format("{:.6f},{},{}{}{},{},{},{}", result.stamp, to_string(result.status),
                            pose_fields(result), fit_fields(result), to_string(result.prior_used),
                            result.particles,
                            relocalization ? to_string(relocalization->verdict) : "",
                            relocalization ? std::to_string(relocalization->places.size()) : ""));
}

void LocalizationLog::add_events(const LocalizationResult& result) {
    const double stamp = result.stamp;
    if (result.relocalization && tells_news(*result.relocalization)) {
        add_event(stamp, result.relocalization->of_filter ? "particles" : "search",
                  places_json(*result.relocalization));
    }
    if (result.jump) {
        add_event(stamp, "jump", jump_json(*result.jump));
    }
    if (result.status != status_) {
        add_event(stamp, "status",
                  {{"from", to_string(status_)},
                   {"to", to_string(result.status)},
                   {"pose", result.map_from_robot ? to_json(*result.map_from_robot) : Json()},
                   {"score", rounded(result.score)}});
        status_ = result.status;
    }
}

void LocalizationLog::add_event(double stamp, const std::string& kind, const Json& facts) {
    Json event = {{"stamp", rounded(stamp)}, {"event", kind}};
    event.update(facts);
    events_->add(event.dump());
}

/// A particle filter answers at each scan, mostly the same.
bool LocalizationLog::tells_news(const Relocalization& relocalization) {
    const bool news = !relocalization.of_filter || verdict_ != relocalization.verdict ||
                      places_ != relocalization.places.size();
    verdict_ = relocalization.verdict;
    places_ = relocalization.places.size();
    return news;
}

}  // namespace hybrid_slam::tools
