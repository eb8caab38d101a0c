// SPDX-License-Identifier: Apache-2.0
#include "navigation/tour.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hybrid_slam/can/candump.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/recording/recording.hpp"
#include "hybrid_slam/simulator/truck_world.hpp"

namespace hybrid_slam::test {
namespace {

constexpr double kTick = 0.02;  ///< seconds of a lockstep

double error_at(const StampedPose& estimate, const TrajectoryIndex& truth) {
    auto true_pose = truth.interpolated(estimate.stamp, 0.2);
    if (!true_pose) {  // the last stamp may be a little behind the last true one, standing
        true_pose = truth.nearest(estimate.stamp, 0.1);
    }
    return true_pose ? (estimate.pose.translation - true_pose->translation).norm()
                     : std::numeric_limits<double>::infinity();
}

const StampedPose& nearest_to(const Eigen::Vector2d& place, const Trajectory& trajectory) {
    return *std::min_element(
        trajectory.begin(), trajectory.end(), [&](const auto& a, const auto& b) {
            return (a.pose.translation - place).norm() < (b.pose.translation - place).norm();
        });
}

/// Is what the drive said, not what the truck answered.
bool is_from_drive(const CanFrame& frame) {
    return frame.id == 0x203 || frame.id == 0x000;
}

double distance(const Eigen::Vector2d& point, const Segment& segment) {
    const Eigen::Vector2d along = segment.end - segment.start;
    const double share =
        along.squaredNorm() > 0.0 ? (point - segment.start).dot(along) / along.squaredNorm() : 0.0;
    return (segment.start + std::clamp(share, 0.0, 1.0) * along - point).norm();
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() * b.y() - a.y() * b.x();
}

bool crosses(const Segment& a, const Segment& b) {
    const Eigen::Vector2d along_a = a.end - a.start;
    const Eigen::Vector2d along_b = b.end - b.start;
    return cross(along_a, b.start - a.start) * cross(along_a, b.end - a.start) < 0.0 &&
           cross(along_b, a.start - b.start) * cross(along_b, a.end - b.start) < 0.0;
}

double distance(const Segment& a, const Segment& b) {
    return crosses(a, b) ? 0.0
                         : std::min({distance(a.start, b), distance(a.end, b), distance(b.start, a),
                                     distance(b.end, a)});
}

std::vector<Segment> outline(const VehicleConfig& vehicle, const Pose2d& world_from_robot) {
    const double side = 0.5 * vehicle.footprint_width;
    const Points corners = transform(world_from_robot, {{vehicle.footprint_front, side},
                                                        {-vehicle.footprint_rear, side},
                                                        {-vehicle.footprint_rear, -side},
                                                        {vehicle.footprint_front, -side}});
    std::vector<Segment> edges;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        edges.push_back({corners[i], corners[(i + 1) % corners.size()]});
    }
    return edges;
}

/// Of a place that is given, out of an outline that goes round it anticlockwise.
bool is_inside(const std::vector<Segment>& edges, const Eigen::Vector2d& point) {
    return std::all_of(edges.begin(), edges.end(), [&](const Segment& edge) {
        return cross(edge.end - edge.start, point - edge.start) > 0.0;
    });
}

}  // namespace

TourErrors tour_errors(const Trajectory& world_from_robot, const Trajectory& truth) {
    const TrajectoryIndex index(truth);
    const double passing = nearest_to(kTourPlaces[0], truth).stamp;
    const auto when = std::min_element(
        world_from_robot.begin(), world_from_robot.end(), [&](const auto& a, const auto& b) {
            return std::abs(a.stamp - passing) < std::abs(b.stamp - passing);
        });
    return {error_at(world_from_robot.front(), index), error_at(*when, index),
            error_at(world_from_robot.back(), index)};
}

TourResult judge_tour(const ClosedLoop& loop, const LoopMap& map, const Trip& trip) {
    const Trajectory truth = loop.truth();
    Trajectory estimate = loop.published();
    for (StampedPose& pose : estimate) {
        pose.pose = map.map_from_world.inverse() * pose.pose;
    }
    TourResult result;
    result.slam = tour_errors(estimate, truth);
    const auto away = [](const StampedPose& pose, const Eigen::Vector2d& place) {
        return (pose.pose.translation - place).norm();
    };
    result.passed = away(nearest_to(kTourPlaces[0], truth), kTourPlaces[0]);
    result.missed = away(truth.back(), kTourPlaces[1]);
    result.contacts = loop.summary()["contacts"].get<int>();
    result.arrived = trip.end == TripEnd::kArrived;
    result.why = trip.why;
    return result;
}

void record_again(const ClosedLoop& loop, const LoopMap& map, int seed,
                  const std::filesystem::path& out) {
    SimulatedDriveConfig config;
    read_drive_section(map.world, config);
    config.seed = seed;
    config.camera = false;
    RobotConfig robot;
    robot.camera.enabled = false;
    TruckWorld truck(read_world(map.world), robot, config, kTourStart);
    RecordingOptions options;
    options.origin = "simulated";
    RecordingWriter writer(out, robot, options);
    double now = 0.0;
    const auto go_on = [&](double end) {
        while (now + 0.5 * kTick < end) {
            now += kTick;
            for (LidarBytes& telegram : truck.advance(now).lidar) {
                writer.push(std::move(telegram));
            }
        }
    };
    for (const CandumpLine& line : read_candump(loop.bus())) {
        go_on(1e-6 * static_cast<double>(line.microseconds));
        if (is_from_drive(line.frame)) {
            truck.receive(line.frame);
        }
    }
    writer.close();
    const Json there = loop.summary()["pose"];
    const double off = (truck.state().world_from_robot.translation -
                        Eigen::Vector2d(there[0].get<double>(), there[1].get<double>()))
                           .norm();
    if (off > 0.001) {
        throw Error("the drive that was recorded again ends " + std::to_string(off) + " m away");
    }
}

double true_clearance(const World& world, const VehicleConfig& vehicle,
                      const Pose2d& world_from_robot) {
    const std::vector<Segment> edges = outline(vehicle, world_from_robot);
    double least = std::numeric_limits<double>::infinity();
    for (const Segment& edge : edges) {
        for (const Segment& wall : world.walls) {
            least = std::min(least, is_inside(edges, wall.start) ? 0.0 : distance(edge, wall));
        }
        for (const Circle& post : world.posts) {
            const double gap = distance(post.center, edge) - post.radius;
            least = std::min(least, is_inside(edges, post.center) ? 0.0 : std::max(gap, 0.0));
        }
    }
    return least;
}

}  // namespace hybrid_slam::test
