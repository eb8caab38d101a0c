// SPDX-License-Identifier: Apache-2.0
#include "vision_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "hybrid_slam/sensors/sensor_source.hpp"

namespace hybrid_slam {
namespace {

constexpr double kDriftDistance = 10.0;  ///< metres
constexpr double kMaxGap = 0.2;          ///< seconds between true poses

std::vector<std::string> joined(std::vector<std::string> first,
                                const std::vector<std::string>& second) {
    first.insert(first.end(), second.begin(), second.end());
    return first;
}

/// Plays what was seen.
class Replay : public Source {
  public:
    explicit Replay(const std::vector<Measurement>& measurements) : measurements_(measurements) {}

    std::optional<Measurement> next() override {
        return place_ < measurements_.size() ? std::optional(measurements_[place_++])
                                             : std::nullopt;
    }

  private:
    const std::vector<Measurement>& measurements_;
    std::size_t place_ = 0;
};

/// The greatest error of the heading between any pose and the first one that is 10 m of true way
/// further on.
double greatest_drift_deg(const Trajectory& estimate, const Trajectory& truth) {
    const TrajectoryIndex index(truth);
    std::vector<std::pair<Pose2d, Pose2d>> pairs;  // true, estimated
    std::vector<double> way;
    for (const StampedPose& pose : estimate) {
        if (const auto known = index.interpolated(pose.stamp, kMaxGap)) {
            way.push_back(way.empty() ? 0.0
                                      : way.back() +
                                            between(pairs.back().first, *known).translation.norm());
            pairs.emplace_back(*known, pose.pose);
        }
    }
    double greatest = 0.0;
    for (std::size_t from = 0, to = 0; from < pairs.size(); ++from) {
        while (to < pairs.size() && way[to] - way[from] < kDriftDistance) {
            ++to;
        }
        if (to == pairs.size()) {
            break;
        }
        const Pose2d known = between(pairs[from].first, pairs[to].first);
        const Pose2d estimated = between(pairs[from].second, pairs[to].second);
        greatest = std::max(greatest, std::abs(between(known, estimated).heading));
    }
    return degrees(greatest);
}

}  // namespace

Way read_way(const std::filesystem::path& file_or_empty,
             const std::vector<std::string>& overrides) {
    Way way;
    ConfigSchema schema;
    {
        const ConfigSchema::Section section(schema, "vo");
        describe(schema, way.vo);
    }
    describe(schema, way.slam);
    if (!file_or_empty.empty()) {
        schema.load(file_or_empty);
    }
    for (const std::string& assignment : overrides) {
        schema.override_with(assignment);
    }
    return way;
}

std::string name_of(WayIndex way) {
    static const std::vector<std::string> names{"plain ICP",       "VO only, thesis", "VO only",
                                                "thesis pipeline", "VO-seeded ICP",   "+ graph"};
    return names.at(way);
}

std::vector<Way> comparison_ways(const VisionOptions& options) {
    const std::filesystem::path configs = options.worlds.parent_path();
    const auto with = [&options](const std::vector<std::string>& more) {
        return read_way({}, joined(options.overrides, more));
    };
    const std::vector<std::string> vo_only{"odometry.prior=visual", "odometry.reference=none",
                                           "graph.enabled=false"};
    std::vector<Way> ways(kWays);
    ways[kPlain] = read_way(configs / "plain_icp.yaml", {});
    ways[kVoThesis] = with(joined(vo_only, {"vo.method=thesis"}));
    ways[kVo] = with(vo_only);
    ways[kThesis] = read_way(configs / "thesis.yaml", {});
    ways[kSeeded] = with({"odometry.prior=visual", "graph.enabled=false"});
    ways[kSeededGraph] = with({"odometry.prior=visual", "graph.enabled=true"});
    return ways;
}

double SeenDrive::highest_turn_rate() const {
    double highest = 0.0;
    for (std::size_t i = 1; i < truth.size(); ++i) {
        const double turned = std::abs(between(truth[i - 1].pose, truth[i].pose).heading);
        highest = std::max(highest, turned / (truth[i].stamp - truth[i - 1].stamp));
    }
    return highest;
}

SeenDrive see_drive(const DriveChoice& choice, const VisualOdometryConfig& vo) {
    const RobotConfig robot;
    SimulatedVehicle vehicle(choice.world, choice.path, robot, choice.config);
    SensorSource source(vehicle, robot, SensorSource::Images::kGray);
    std::map<VisualMethod, VisualOdometry> viewers;
    for (const VisualMethod method : {VisualMethod::kThesis, VisualMethod::kJoint}) {
        VisualOdometryConfig config = vo;
        config.method = method;
        viewers.emplace(method, VisualOdometry(robot.camera.model, robot.camera.mounting, config));
    }
    SeenDrive seen;
    std::size_t scans = 0;
    while (const auto measurement = source.next()) {
        const auto* scan = std::get_if<Scan>(&*measurement);
        if (scan != nullptr && scans++ % choice.scan_step != 0) {
            continue;
        }
        seen.scans += scan != nullptr ? 1 : 0;
        for (auto& [method, viewer] : viewers) {
            if (scan != nullptr) {
                viewer.see(*scan);
                seen.measurements[method].push_back(*measurement);
            } else {
                const VisualMotion motion = viewer.track(std::get<Image>(*measurement));
                ++seen.statuses[method][motion.status];
                seen.measurements[method].emplace_back(motion);
            }
        }
    }
    seen.truth = vehicle.truth();
    return seen;
}

std::string words_of(const std::map<VisualStatus, std::size_t>& statuses) {
    std::string words;
    for (const auto& [status, count] : statuses) {
        words += fmt::format("{}{} {}", words.empty() ? "" : ", ", count, to_string(status));
    }
    return words;
}

Session replay(const SeenDrive& drive, const Way& way) {
    Replay source(drive.measurements.at(way.vo.method));
    return run_session(source, way.slam);
}

void DriveErrors::take_worst(const DriveErrors& other) {
    rmse = std::max(rmse, other.rmse);
    heading_rmse_deg = std::max(heading_rmse_deg, other.heading_rmse_deg);
    greatest = std::max(greatest, other.greatest);
    at_end = std::max(at_end, other.at_end);
    drift_rmse_deg = std::max(drift_rmse_deg, other.drift_rmse_deg);
    drift_greatest_deg = std::max(drift_greatest_deg, other.drift_greatest_deg);
    icp_failures += other.icp_failures;
}

DriveErrors errors_of(const Session& session, const Trajectory& truth) {
    TruthOptions options;
    options.alignment = TruthAlignment::kFirstPose;
    options.max_gap = kMaxGap;
    options.rpe_distance = kDriftDistance;
    const Trajectory& trajectory = session.map.trajectory;
    const TruthError error = truth_error(trajectory, truth, options);
    DriveErrors errors;
    errors.rmse = error.ate_rmse;
    errors.heading_rmse_deg = degrees(error.heading_rmse);
    errors.greatest = error.ate_max;
    const TrajectoryIndex index(truth);
    for (auto last = trajectory.rbegin(); last != trajectory.rend(); ++last) {
        if (const auto known = index.interpolated(last->stamp, kMaxGap)) {
            const Pose2d estimate = error.truth_from_estimate * last->pose;
            errors.at_end = (estimate.translation - known->translation).norm();
            break;
        }
    }
    errors.drift_rmse_deg = degrees(error.rpe_rotation_rmse);
    errors.drift_greatest_deg = greatest_drift_deg(trajectory, truth);
    errors.icp_failures = session.not_aligned;
    return errors;
}

}  // namespace hybrid_slam
