// SPDX-License-Identifier: Apache-2.0
#include "localization.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hybrid_slam/odometry/scan_filter.hpp"
#include "hybrid_slam/sensors/sensor_source.hpp"
#include "support/s300_scan.hpp"

namespace hybrid_slam {

namespace {

struct Topic {
    const char* name;
    int (*measure)(const LocalizationOptions&, std::ostream&);
};

constexpr Topic kTopics[] = {
    {"table", measure_table_poses},    {"hall", measure_hall_poses},
    {"racks", measure_racks},          {"rack_drives", measure_rack_drives},
    {"symmetric", measure_symmetric},  {"walls", measure_walls},
    {"tracking", measure_tracking},    {"kidnap", measure_kidnaps},
    {"changed", measure_changed_hall}, {"speed", measure_search_speed},
    {"logs", measure_log_places}};

}  // namespace

std::vector<std::string> localization_topics() {
    std::vector<std::string> names;
    for (const Topic& topic : kTopics) {
        names.emplace_back(topic.name);
    }
    return names;
}

int run_localization_benchmark(const LocalizationOptions& options, std::ostream& out) {
    int misses = 0;
    for (const Topic& topic : kTopics) {
        if (std::find(options.topics.begin(), options.topics.end(), topic.name) !=
            options.topics.end()) {
            misses += topic.measure(options, out);
            out.flush();
        }
    }
    return misses;
}

Pose2d MappedWorld::expected(const Pose2d& world_from_robot) const {
    std::size_t nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < truth.size(); ++i) {
        const double away =
            (truth[i].pose.translation - world_from_robot.translation).squaredNorm();
        if (away < least) {
            least = away;
            nearest = i;
        }
    }
    return map.graph.nodes[nearest] * between(truth[nearest].pose, world_from_robot);
}

std::shared_ptr<const ReferenceMap> reference_of(const SlamMap& map) {
    StoredMap stored;
    stored.keyframes = map.keyframes;
    stored.graph = map.graph;
    stored.grid = to_states(draw_grid(stored.keyframes, stored.graph));
    return reference_of(stored);
}

MappedWorld map_world(const World& world, const std::string& path,
                      const SimulatedDriveConfig& config) {
    const RobotConfig robot;
    SimulatedDriveConfig lidar_only = config;
    lidar_only.camera = false;
    SimulatedVehicle vehicle(world, path, robot, lidar_only);
    SensorSource source(vehicle, robot);
    MappedWorld mapped;
    mapped.world = world;
    mapped.map = run_session(source, slam_config({})).map;
    mapped.reference = reference_of(mapped.map);
    const TrajectoryIndex index(vehicle.truth());
    for (const Keyframe& keyframe : mapped.map.keyframes) {
        const auto pose = index.interpolated(keyframe.stamp, 0.5);
        mapped.truth.push_back({keyframe.stamp, pose.value_or(vehicle.truth().back().pose)});
    }
    mapped.map_from_world =
        truth_error(mapped.map.trajectory, vehicle.truth()).truth_from_estimate.inverse();
    return mapped;
}

MappedWorld map_truly(const World& world, const std::string& path) {
    constexpr double kStep = 0.4;  // metres
    const Pose2d robot_from_laser = RobotConfig().lidar.robot_from_laser();
    const Points& way = world.path_named(path);
    std::mt19937 random(1);
    MappedWorld mapped;
    mapped.world = world;
    for (std::size_t i = 1; i < way.size(); ++i) {
        const Point2 leg = way[i] - way[i - 1];
        if (world.cast_ray(way[i - 1], leg.normalized()) < leg.norm()) {
            continue;  // into the next one of several halls
        }
        for (double at = 0.0; at < leg.norm(); at += kStep) {
            const Pose2d pose(way[i - 1] + at / leg.norm() * leg, std::atan2(leg.y(), leg.x()));
            const double stamp = static_cast<double>(mapped.truth.size());
            mapped.truth.push_back({stamp, pose});
            mapped.map.graph.nodes.push_back(pose);
            mapped.map.keyframes.push_back(
                {stamp, 0.0, pose, robot_from_laser,
                 sweep_at(world, pose, robot_from_laser, 0.02, 0.0, random).surface});
        }
    }
    mapped.reference = reference_of(mapped.map);
    return mapped;
}

Scan scan_at(const World& world, const Pose2d& world_from_robot, const Pose2d& robot_from_laser,
             double sigma, double bias, std::mt19937& random) {
    return test::scan_at(world, world_from_robot, random, sigma, robot_from_laser, bias);
}

Sweep sweep_at(const World& world, const Pose2d& world_from_robot, const Pose2d& robot_from_laser,
               double sigma, double bias, std::mt19937& random) {
    const Scan scan = scan_at(world, world_from_robot, robot_from_laser, sigma, bias, random);
    return {robot_from_laser.translation, to_surface(scan, ScanFilterConfig())};
}

std::vector<Pose2d> random_poses(const MappedWorld& mapped, std::size_t count,
                                 const Pose2d& robot_from_laser, unsigned seed) {
    std::mt19937 random(seed);
    const StateGrid& grid = mapped.reference->grid();
    const auto uniform = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    const auto is_clear = [&](const Point2& place) {
        return grid.at(grid.geometry.cell_of(place)) == CellState::kFree &&
               mapped.reference->nearest(place) == ReferenceMap::kNothing;
    };
    const Pose2d world_from_map = mapped.map_from_world.inverse();
    std::vector<Pose2d> poses;
    while (poses.size() < count) {
        const Pose2d map_from_robot(
            grid.geometry.origin.x() + uniform(0.0, grid.geometry.width * grid.geometry.resolution),
            grid.geometry.origin.y() +
                uniform(0.0, grid.geometry.height * grid.geometry.resolution),
            uniform(-kPi, kPi));
        if (is_clear(map_from_robot.translation) &&
            is_clear((map_from_robot * robot_from_laser).translation)) {
            poses.push_back(world_from_map * map_from_robot);
        }
    }
    return poses;
}

bool is_there(const Pose2d& found, const Pose2d& expected) {
    const Pose2d off = between(expected, found);
    return off.translation.norm() <= 0.25 && std::abs(off.heading) <= radians(3.0);
}

void Tally::take(const Relocalization& found, const Pose2d& expected, double elapsed) {
    ++asked;
    seconds += elapsed;
    worst_seconds = std::max(worst_seconds, elapsed);
    switch (found.verdict) {
        case PlaceVerdict::kFound:
            ++(is_there(found.places.front().map_from_robot, expected) ? right : wrong);
            break;
        case PlaceVerdict::kAmbiguous:
            ++ambiguous;
            listed +=
                std::any_of(found.places.begin(), found.places.end(),
                            [&](const Place& p) { return is_there(p.map_from_robot, expected); })
                    ? 1
                    : 0;
            break;
        case PlaceVerdict::kNotInMap:
            ++not_in_map;
            break;
        case PlaceVerdict::kUnfinished:
            ++unfinished;
            break;
    }
}

std::string Tally::text() const {
    const auto share = [this](std::size_t part) {
        return 100.0 * static_cast<double>(part) /
               static_cast<double>(std::max<std::size_t>(1, asked));
    };
    return fmt::format(
        "{} asked: found and right {:.1f} %, wrong but sure {}, ambiguous {:.1f} % ({} of {} list "
        "the true place), not in map {:.1f} %, unfinished {:.1f} %; {:.1f} ms mean, {:.1f} ms "
        "worst",
        asked, share(right), wrong, share(ambiguous), listed, ambiguous, share(not_in_map),
        share(unfinished), 1e3 * seconds / static_cast<double>(std::max<std::size_t>(1, asked)),
        1e3 * worst_seconds);
}

}  // namespace hybrid_slam
