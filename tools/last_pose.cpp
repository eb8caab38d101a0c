// SPDX-License-Identifier: Apache-2.0
#include "last_pose.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <nlohmann/json.hpp>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"
#include "place_report.hpp"
#include "run_folder.hpp"

namespace hybrid_slam::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr auto kFormat = "hybrid_slam last pose";
constexpr int kVersion = 1;
constexpr std::size_t kMostBytes = std::size_t{1} << 16U;

Eigen::Matrix3d matrix_of(const Json& rows) {
    Eigen::Matrix3d matrix;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            matrix(row, column) = rows.at(row).at(column).get<double>();
        }
    }
    return matrix;
}

LastPose last_pose_of(const Json& json) {
    LastPose last;
    last.map = json.at("map").at("path").get<std::string>();
    last.map_identity = json.at("map").at("identity").get<std::string>();
    last.stamp = json.at("stamp").get<double>();
    last.map_from_robot = {json.at("x_m").get<double>(), json.at("y_m").get<double>(),
                           radians(json.at("heading_deg").get<double>())};
    last.covariance = matrix_of(json.at("covariance"));
    last.score = json.at("score").get<double>();
    return last;
}

bool makes_sense(const LastPose& last) {
    const Eigen::Matrix3d& covariance = last.covariance;
    return last.map_from_robot.vector().allFinite() && covariance.allFinite() &&
           covariance.isApprox(covariance.transpose(), 1e-9) && covariance.ldlt().isPositive();
}

}  // namespace

void write_last_pose(const std::filesystem::path& file, const LastPose& last) {
    const Pose2d& pose = last.map_from_robot;
    const Json json = {{"format", kFormat},
                       {"version", kVersion},
                       {"map", {{"path", last.map}, {"identity", last.map_identity}}},
                       {"stamp", last.stamp},
                       {"x_m", pose.x()},
                       {"y_m", pose.y()},
                       {"heading_deg", degrees(pose.heading)},
                       {"covariance", matrix_json(last.covariance)},
                       {"score", last.score}};
    replace_text(file, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

LastPose read_last_pose(const std::filesystem::path& file) {
    const Json json = Json::parse(read_whole_file(file, kMostBytes), nullptr, false);
    if (!json.is_object() || json.value("format", Json()) != Json(kFormat)) {
        throw Error(file.string() + ": is no last pose of a run");
    }
    if (const Json version = json.value("version", Json()); version != Json(kVersion)) {
        throw Error(fmt::format("{}: has version {}, but only version {} can be read",
                                file.string(), version.dump(), kVersion));
    }
    LastPose last;
    try {
        last = last_pose_of(json);
    } catch (const Json::exception&) {
        throw Error(file.string() + ": damaged: a key is missing or no number");
    }
    if (!makes_sense(last)) {
        throw Error(file.string() + ": damaged: its pose or covariance makes no sense");
    }
    return last;
}

}  // namespace hybrid_slam::tools
