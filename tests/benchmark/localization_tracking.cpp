// SPDX-License-Identifier: Apache-2.0
#include <fmt/ostream.h>

#include <Eigen/LU>
#include <cmath>

#include "hybrid_slam/localization/localizer.hpp"
#include "hybrid_slam/sensors/sensor_source.hpp"
#include "hybrid_slam/vision/visual_source.hpp"
#include "localization.hpp"

namespace hybrid_slam {
namespace {

constexpr double kMapDistance = 60.0;    ///< metres
constexpr double kTrackDistance = 30.0;  ///< metres
constexpr double kMaxGap = 0.5;          ///< seconds between true poses
constexpr int kKidnaps = 100;
constexpr double kBeforeKidnap = 2.0;   ///< seconds of tracking
constexpr double kAskedNoticed = 1.0;   ///< seconds
constexpr double kAskedRight = 3.0;     ///< seconds
constexpr double kAskedChanged = 0.02;  ///< metres
constexpr double kAskedNew = 0.4;       ///< share of beams on things that the map does not have

SimulatedDriveConfig drive_of(double speed, double distance, bool camera, int seed) {
    SimulatedDriveConfig config;
    config.speed = speed;
    config.distance = distance;
    config.range_sigma = 0.02;
    config.camera = camera;
    config.seed = seed;
    return config;
}

struct SeenFrames {
    std::vector<Frame> frames;
    std::vector<Pose2d> truth;  ///< world_from_robot at the frames

    double period() const { return frames[1].scan.stamp - frames[0].scan.stamp; }  ///< seconds
};

SeenFrames see_frames(const World& world, const std::string& path,
                      const SimulatedDriveConfig& config) {
    const RobotConfig robot;
    SimulatedVehicle vehicle(world, path, robot, config);
    SensorSource sensors(vehicle, robot, SensorSource::Images::kGray);
    VisualOdometry vision(robot.camera.model, robot.camera.mounting);
    VisualSource source(sensors, vision);
    FrameAssembler assembler(FrameAssembler::kVisualWait);
    std::vector<Frame> frames;
    const auto keep = [&](std::optional<Frame> frame) {
        if (frame) {
            frames.push_back(std::move(*frame));
        }
    };
    while (auto measurement = source.next()) {
        keep(assembler.push(std::move(*measurement)));
    }
    keep(assembler.flush());
    const TrajectoryIndex index(vehicle.truth());
    SeenFrames seen;
    for (Frame& frame : frames) {
        if (const auto pose = index.interpolated(frame.scan.stamp, kMaxGap)) {
            seen.frames.push_back(std::move(frame));
            seen.truth.push_back(*pose);
        }
    }
    return seen;
}

bool holds(const LocalizationResult& result) {
    return result.map_from_robot && (result.status == LocalizationStatus::kTracking ||
                                     result.status == LocalizationStatus::kDegraded);
}

struct TrackErrors {
    std::size_t poses = 0;
    std::size_t unknown = 0;
    std::size_t lost = 0;
    std::size_t jumps = 0;
    double squared = 0.0;
    double squared_heading = 0.0;
    double worst = 0.0;
    double nees = 0.0;  ///< sum of e^T C^-1 e, 3 each when the covariance is honest
    double unmapped = 0.0;

    double rmse_cm() const { return 100.0 * std::sqrt(squared / static_cast<double>(poses)); }
    double rmse_deg() const {
        return degrees(std::sqrt(squared_heading / static_cast<double>(poses)));
    }
    double mean_nees() const { return nees / static_cast<double>(poses); }
    /// The mean of chi2 with three degrees of freedom is 3; errors of one drive go together.
    bool is_honest() const { return mean_nees() >= 1.0 && mean_nees() <= 6.0; }
    std::string text() const {
        return fmt::format(
            "{:.2f} cm / {:.3f} deg RMSE, worst {:.2f} cm, NEES {:.2f} (3 is honest, 1 to 6 "
            "asked), unknown at first {} scans, lost {} times, jumps {}",
            rmse_cm(), rmse_deg(), 100.0 * worst, mean_nees(), unknown, lost, jumps);
    }
};

/// Through the map from an unknown start.
TrackErrors track(const MappedWorld& mapped, const SeenFrames& seen) {
    Localizer localizer(mapped.reference, LocalizationConfig());
    TrackErrors errors;
    for (std::size_t i = 0; i < seen.frames.size(); ++i) {
        const LocalizationResult result = localizer.process(seen.frames[i]);
        errors.lost += result.status == LocalizationStatus::kLost ? 1 : 0;
        errors.jumps += result.jump ? 1 : 0;
        if (!holds(result)) {
            ++errors.unknown;
            continue;
        }
        const Pose2d expected = mapped.map_from_world * seen.truth[i];
        const Pose2d off = between(expected, *result.map_from_robot);
        const Eigen::Vector3d error(result.map_from_robot->x() - expected.x(),
                                    result.map_from_robot->y() - expected.y(), off.heading);
        ++errors.poses;
        errors.squared += off.translation.squaredNorm();
        errors.squared_heading += off.heading * off.heading;
        errors.worst = std::max(errors.worst, off.translation.norm());
        errors.nees += error.dot(result.covariance.inverse() * error);
        errors.unmapped += result.fit.unmapped;
    }
    return errors;
}

}  // namespace

int measure_tracking(const LocalizationOptions& options, std::ostream& out) {
    const World world = read_world(options.worlds / "thesis_hall.yaml");
    const MappedWorld mapped = map_world(world, "", drive_of(0.3, kMapDistance, false, 1));
    struct Asked {
        double speed;
        double cm;
        double deg;
    };
    int misses = 0;
    fmt::print(out,
               "Tracking in the hall's map by our own mapping, with the camera, from an unknown "
               "start, {:g} m of figure_eight; map and world by best fit of the mapping drive\n",
               kTrackDistance);
    for (const Asked& asked : {Asked{0.3, 0.8, 0.12}, Asked{1.0, 1.2, 0.2}}) {
        const TrackErrors errors = track(
            mapped,
            see_frames(world, "figure_eight", drive_of(asked.speed, kTrackDistance, true, 2)));
        const bool good = errors.poses > 0 && errors.rmse_cm() <= asked.cm &&
                          errors.rmse_deg() <= asked.deg && errors.lost == 0 && errors.is_honest();
        fmt::print(out, "{:g} m/s: {}   asked {:g} cm / {:g} deg   {}\n", asked.speed,
                   errors.text(), asked.cm, asked.deg, good ? "ok" : "MISS");
        misses += good ? 0 : 1;
    }
    fmt::print(out, "\n");
    return misses;
}

int measure_changed_hall(const LocalizationOptions& options, std::ostream& out) {
    const World world = read_world(options.worlds / "thesis_hall.yaml");
    const MappedWorld mapped = map_world(world, "", drive_of(0.3, kMapDistance, false, 1));
    World changed = world;
    // Pallets along the walls and posts in the open: what a night shift leaves.
    const auto add_box = [&](const Point2& center, const Point2& size) {
        const Point2 half = 0.5 * size;
        const Points corners{center - half, center + Point2(half.x(), -half.y()), center + half,
                             center + Point2(-half.x(), half.y())};
        for (std::size_t i = 0; i < 4; ++i) {
            changed.walls.push_back({corners[i], corners[(i + 1) % 4]});
        }
    };
    for (const double x : {-3.0, -1.2, 0.6, 2.4}) {
        add_box({x, -3.1}, {1.2, 0.8});
        add_box({x + 0.4, 3.1}, {1.2, 0.8});
    }
    add_box({-4.7, 0.6}, {0.5, 1.6});
    add_box({-4.7, -1.5}, {0.5, 1.2});
    const TrackErrors errors =
        track(mapped, see_frames(changed, "figure_eight", drive_of(0.3, kTrackDistance, false, 3)));
    const double share = errors.unmapped / static_cast<double>(errors.poses);
    const bool good = errors.poses > 0 && errors.rmse_cm() <= 100.0 * kAskedChanged &&
                      errors.lost == 0 && errors.is_honest() && share >= kAskedNew;
    fmt::print(out,
               "Changed hall, {:.0f} % of the beams on new things: {}   asked {:g} cm, no loss   "
               "{}\n\n",
               100.0 * share, errors.text(), 100.0 * kAskedChanged, good ? "ok" : "MISS");
    return good ? 0 : 1;
}

namespace {

/// What became of one kidnap; seconds since then, negative for never.
struct Kidnap {
    double told = -1.0;  ///< that the place is no longer known, or a jump
    double right = -1.0;
    bool jumped = false;
};

/// Tracks `before` scans from `from` on, then goes on with `after` scans from `to` on.
Kidnap carry_away(const MappedWorld& mapped, const SeenFrames& seen, std::size_t from,
                  std::size_t to, std::size_t before, std::size_t after) {
    Localizer localizer(mapped.reference, LocalizationConfig());
    Kidnap kidnap;
    const double start = seen.frames[from].scan.stamp;
    const double period = seen.period();
    for (std::size_t i = 0; i < before + after; ++i) {
        const std::size_t source = i < before ? from + i : to + i - before;
        Frame frame = seen.frames[source];
        frame.scan.stamp = start + period * static_cast<double>(i);
        const LocalizationResult result = localizer.process(frame);
        if (i < before) {
            continue;
        }
        const double since = period * static_cast<double>(i - before);
        kidnap.jumped = kidnap.jumped || result.jump.has_value();
        if (kidnap.told < 0.0 && (!holds(result) || result.jump)) {
            kidnap.told = since;
        }
        const Pose2d expected = mapped.map_from_world * seen.truth[source];
        const bool there = holds(result) && is_there(*result.map_from_robot, expected);
        kidnap.right = !there ? -1.0 : kidnap.right < 0.0 ? since : kidnap.right;
    }
    return kidnap;
}

struct KidnapTally {
    int noticed = 0;
    int right = 0;
    int silent = 0;
    double slowest_notice = 0.0;
    double slowest_right = 0.0;

    void take(const Kidnap& kidnap) {
        noticed += kidnap.told >= 0.0 && kidnap.told <= kAskedNoticed ? 1 : 0;
        right += kidnap.right >= 0.0 && kidnap.right <= kAskedRight ? 1 : 0;
        silent += kidnap.right >= 0.0 && !kidnap.jumped ? 1 : 0;
        slowest_notice = std::max(slowest_notice, kidnap.told < 0.0 ? INFINITY : kidnap.told);
        slowest_right = std::max(slowest_right, kidnap.right < 0.0 ? INFINITY : kidnap.right);
    }
};

}  // namespace

int measure_kidnaps(const LocalizationOptions& options, std::ostream& out) {
    const World world = read_world(options.worlds / "thesis_hall.yaml");
    const MappedWorld mapped = map_world(world, "", drive_of(0.3, kMapDistance, false, 1));
    const SeenFrames seen = see_frames(world, "figure_eight", drive_of(0.3, 60.0, false, 4));
    const auto scans_in = [&](double seconds) {
        return static_cast<std::size_t>(std::ceil(seconds / seen.period()));
    };
    const std::size_t before = scans_in(kBeforeKidnap);
    const std::size_t after = scans_in(kAskedRight + 2.0);
    std::mt19937 random(9);
    std::uniform_int_distribution<std::size_t> any(0, seen.frames.size() - before - after - 1);
    KidnapTally tally;
    for (int kidnaps = 0; kidnaps < kKidnaps;) {
        const std::size_t from = any(random);
        const std::size_t to = any(random);
        const Pose2d apart = between(seen.truth[from + before], seen.truth[to]);
        if (apart.translation.norm() >= 1.0 || std::abs(apart.heading) >= radians(30.0)) {
            tally.take(carry_away(mapped, seen, from, to, before, after));
            ++kidnaps;
        }
    }
    const bool good = tally.noticed == kKidnaps && tally.right == kKidnaps && tally.silent == 0;
    fmt::print(
        out,
        "{} kidnaps while tracking: noticed within {:g} s {}, slowest {:.2f} s; right within "
        "{:g} s {}, slowest {:.2f} s; silent jumps {}   asked all, all, none   {}\n\n",
        kKidnaps, kAskedNoticed, tally.noticed, tally.slowest_notice, kAskedRight, tally.right,
        tally.slowest_right, tally.silent, good ? "ok" : "MISS");
    return good ? 0 : 1;
}

}  // namespace hybrid_slam
