// SPDX-License-Identifier: Apache-2.0
#include <fmt/ostream.h>

#include <algorithm>
#include <cmath>

#include "hybrid_slam/core/error.hpp"
#include "vision.hpp"

namespace hybrid_slam {
namespace {

// Of the robot in bare_corridor.yaml: between, both ends are out of the scanner's range.
constexpr double kFrom = 29.1;
constexpr double kTo = 69.1;
constexpr double kMaxGap = 0.2;  ///< seconds between true poses
constexpr double kAsked = 2.0;   ///< percent of the way
constexpr int kMostSeeds = 5;

/// Errors along the corridor since kFrom, in percent of its 40 m.
struct Drift {
    double at_end = 0.0;
    double greatest = 0.0;
};

Drift drift_of(const Trajectory& trajectory, const Trajectory& truth) {
    const TrajectoryIndex index(truth);
    std::optional<Pose2d> world_from_map;
    double error = 0.0;
    Drift drift;
    for (const StampedPose& pose : trajectory) {
        const auto known = index.interpolated(pose.stamp, kMaxGap);
        if (!known || known->x() < kFrom || known->x() > kTo) {
            continue;
        }
        if (!world_from_map) {
            world_from_map = *known * pose.pose.inverse();
        }
        error = (*world_from_map * pose.pose).x() - known->x();
        drift.greatest = std::max(drift.greatest, std::abs(error));
    }
    if (!world_from_map) {
        throw Error("corridor: the drive does not come to the part that is measured");
    }
    drift.at_end = 100.0 * error / (kTo - kFrom);
    drift.greatest *= 100.0 / (kTo - kFrom);
    return drift;
}

struct NamedWay {
    std::string name;
    Way way;
    double worst = 0.0;  ///< percent
};

std::vector<NamedWay> corridor_ways(const VisionOptions& options) {
    const std::vector<Way> ways = comparison_ways(options);
    std::vector<std::string> by_velocity = options.overrides;
    by_velocity.insert(by_velocity.end(),
                       {"odometry.prior=constant_velocity", "graph.enabled=false"});
    return {{name_of(kPlain), ways[kPlain]},
            {"constant velocity", read_way({}, by_velocity)},
            {name_of(kVoThesis), ways[kVoThesis]},
            {name_of(kVo), ways[kVo]},
            {name_of(kThesis), ways[kThesis]},
            {name_of(kSeeded), ways[kSeeded]},
            {name_of(kSeededGraph), ways[kSeededGraph]}};
}

}  // namespace

int measure_corridor(const VisionOptions& options, std::ostream& out) {
    DriveChoice choice{read_world(options.worlds / "bare_corridor.yaml"), "one_way", {}};
    read_drive_section(options.worlds / "bare_corridor.yaml", choice.config);
    const int seeds = std::min(options.seeds, kMostSeeds);
    fmt::print(out,
               "Bare corridor, one_way, {:g} m at {:g} m/s, range sigma {:g} cm: error along the "
               "way from x = {:g} to {:g} m, percent of the way at the end (greatest); seeds 1 to "
               "{}\n{:<8}",
               choice.config.distance, choice.config.speed, 100.0 * choice.config.range_sigma,
               kFrom, kTo, seeds, "");
    std::vector<NamedWay> ways = corridor_ways(options);
    for (const NamedWay& way : ways) {
        fmt::print(out, " {:>18}", way.name);
    }
    for (int seed = 1; seed <= seeds; ++seed) {
        choice.config.seed = seed;
        const SeenDrive drive = see_drive(choice, ways.back().way.vo);
        fmt::print(out, "\nseed {:<3}", seed);
        for (NamedWay& way : ways) {
            const Drift drift = drift_of(replay(drive, way.way).map.trajectory, drive.truth);
            fmt::print(out, " {:>+9.2f} ({:>6.2f})", drift.at_end, drift.greatest);
            way.worst = std::max(way.worst, drift.greatest);
        }
        out.flush();
    }
    const auto ours = std::find_if(
        ways.begin(), ways.end(), [](const NamedWay& way) { return way.name == name_of(kSeeded); });
    const bool good = ours->worst < kAsked;
    fmt::print(out, "\nVO-seeded ICP, greatest of seeds: {:.2f} %   asked below {:g} %   {}\n\n",
               ours->worst, kAsked, good ? "ok" : "MISS");
    return good ? 0 : 1;
}

}  // namespace hybrid_slam
