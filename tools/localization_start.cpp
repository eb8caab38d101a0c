// SPDX-License-Identifier: Apache-2.0
#include "localization_start.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>

#include "hybrid_slam/core/error.hpp"
#include "last_pose.hpp"
#include "map_identity.hpp"
#include "messages.hpp"
#include "place_report.hpp"
#include "run_folder.hpp"

namespace hybrid_slam::tools {
namespace {

namespace fs = std::filesystem;

// How far a vehicle may have rolled, or been pushed, since its last pose.
constexpr double kRolled = 0.1;           ///< metres
constexpr double kTurned = radians(2.0);  ///< radians

Eigen::Matrix3d diagonal(double metres, double angle) {
    return Eigen::Vector3d(metres * metres, metres * metres, angle * angle).asDiagonal();
}

/// Where the map knows nothing, no scan can contradict a pose.
void expect_inside(const ReferenceMap& map, const Pose2d& pose, const std::string& what) {
    const GridGeometry& grid = map.grid().geometry;
    const Point2 upper = grid.origin + grid.resolution * Point2(grid.width, grid.height);
    if ((pose.translation.array() < grid.origin.array()).any() ||
        (pose.translation.array() > upper.array()).any()) {
        throw Error(fmt::format(
            "{}: {:g}, {:g} is not in the map, which reaches from "
            "{:.1f}, {:.1f} to {:.1f}, {:.1f}",
            what, pose.x(), pose.y(), grid.origin.x(), grid.origin.y(), upper.x(), upper.y()));
    }
}

LocalizationStart resumed(const StartOptions& options, const fs::path& out,
                          const fs::path& map_path, const ReferenceMap& map) {
    const fs::path file = last_pose_file(options.resume);
    if ((resumes_itself(options, out) || out.empty()) && !fs::exists(file)) {
        // What always starts so has to start a first time.
        print_info(options.resume.string() + ": no last pose there yet; the start is unknown");
        return {std::nullopt, {}, {{"event", "start"}, {"from", "unknown"}}};
    }
    const LastPose last = read_last_pose(file);
    const std::string identity = identity_of(map);
    if (last.map_identity != identity) {
        throw Error(
            fmt::format("{}: is a pose in another map ('{}', identity {}), not in '{}' ({})",
                        file.string(), last.map, last.map_identity, map_path.string(), identity));
    }
    expect_inside(map, last.map_from_robot, file.string());
    LocalizationStart start;
    start.map_from_robot = last.map_from_robot;
    start.covariance = last.covariance + diagonal(kRolled, kTurned);
    start.event = {{"event", "start"},
                   {"from", "last pose"},
                   {"pose", to_json(last.map_from_robot)},
                   {"stamp", last.stamp}};
    return start;
}

}  // namespace

void add_start_options(CLI::App& command, StartOptions& options) {
    CLI::Option* pose =
        command
            .add_option("--initial-pose", options.initial_pose,
                        "Pose in the map at the first scan: metres, metres, degrees")
            ->delimiter(',')
            ->expected(3)
            ->type_name("X,Y,YAW");
    command
        .add_option("--initial-sigma", options.initial_sigma,
                    "How sure that is: metres, degrees (0.5,10)")
        ->delimiter(',')
        ->expected(2)
        ->needs(pose)
        ->type_name("M,DEG");
    command
        .add_option("--resume", options.resume,
                    "Starts where an earlier run ended: its folder, or a last_pose.json")
        ->excludes(pose)
        ->type_name("RUN");
}

void check_start_options(const StartOptions& options) {
    for (const double value : options.initial_pose) {
        if (!std::isfinite(value)) {
            throw CLI::ValidationError("--initial-pose", "must be three numbers");
        }
    }
    const std::vector<double>& sigma = options.initial_sigma;
    if (!(sigma[0] > 0.0 && sigma[0] < 1e3 && sigma[1] > 0.0 && sigma[1] < 1e3)) {
        throw CLI::ValidationError("--initial-sigma", "must be two numbers above 0");
    }
}

fs::path last_pose_file(const fs::path& place) {
    return fs::is_directory(place) ? place / RunFiles::kLastPose : place;
}

bool resumes_itself(const StartOptions& options, const fs::path& out) {
    std::error_code ignored;
    return !options.resume.empty() &&
           fs::weakly_canonical(options.resume, ignored) == fs::weakly_canonical(out, ignored);
}

LocalizationStart start_of(const StartOptions& options, const fs::path& out,
                           const fs::path& map_path, const ReferenceMap& map) {
    if (!options.resume.empty()) {
        return resumed(options, out, map_path, map);
    }
    if (options.initial_pose.empty()) {
        return {std::nullopt, {}, {{"event", "start"}, {"from", "unknown"}}};
    }
    const std::vector<double>& pose = options.initial_pose;
    LocalizationStart start;
    start.map_from_robot = Pose2d(pose[0], pose[1], normalize_angle(radians(pose[2])));
    start.covariance = diagonal(options.initial_sigma[0], radians(options.initial_sigma[1]));
    expect_inside(map, *start.map_from_robot, "--initial-pose");
    start.event = {
        {"event", "start"}, {"from", "initial pose"}, {"pose", to_json(*start.map_from_robot)}};
    return start;
}

}  // namespace hybrid_slam::tools
