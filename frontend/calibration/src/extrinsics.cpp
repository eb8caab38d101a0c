// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/calibration/extrinsics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "extrinsics_solver.hpp"
#include "hybrid_slam/core/error.hpp"
#include "sensor_motions.hpp"

namespace hybrid_slam {
namespace {

void check(const ExtrinsicsConfig& config) {
    if (!(config.interval > 0.0) || !(config.slip_interval > 0.0) || !(config.max_gap > 0.0)) {
        throw Error("extrinsics: interval, slip_interval and max_gap must be above zero");
    }
}

void measure_drive(const ExtrinsicsDrive& drive, const std::vector<LaserStep>& steps,
                   ExtrinsicsResult& result) {
    result.distance = length_of(drive.lidar);
    double sum = 0.0;
    double squares = 0.0;
    for (const LaserStep& step : steps) {
        // Not from scan to scan, where the noise would turn the more the faster scans come.
        const double turn = step.integral.z();
        (turn > 0.0 ? result.turned_left : result.turned_right) += std::abs(turn);
        const double rate = turn / (step.end - step.begin);
        sum += rate;
        squares += rate * rate;
    }
    const double count = std::max<double>(1.0, static_cast<double>(steps.size()));
    result.rate_spread = std::sqrt(std::max(0.0, squares / count - sum * sum / (count * count)));
}

void find_what_is_missing(const ExtrinsicsConfig& config, ExtrinsicsResult& result) {
    auto& missing = result.missing;
    if (result.distance < config.least_distance) {
        missing.push_back(fmt::format("only {:.1f} m driven, {:.1f} m are needed", result.distance,
                                      config.least_distance));
    }
    const double turned = result.turned_left + result.turned_right;
    if (turned < config.least_turned) {
        missing.push_back(fmt::format("only {:.0f} deg turned, {:.0f} deg are needed",
                                      degrees(turned), degrees(config.least_turned)));
    }
    if (result.rate_spread < config.least_rate_spread) {
        missing.push_back(
            fmt::format("the turn rate hardly changes (standard deviation {:.1f} deg/s, {:.1f} "
                        "deg/s are needed): turn to both sides, with straight parts between",
                        degrees(result.rate_spread), degrees(config.least_rate_spread)));
    }
    if (result.intervals < config.least_intervals) {
        missing.push_back(fmt::format(
            "only {} intervals of {:.1f} s in which scans and images both show motion, {} are "
            "needed",
            result.intervals, config.interval, config.least_intervals));
    }
}

/// Said only of a drive that seemed fit, since otherwise it follows from what is missing.
void find_vague(const ExtrinsicsLimits& limits, ExtrinsicsResult& result) {
    struct Need {
        Extrinsic of;
        double limit;
        double factor;
        const char* unit;
    };
    const double angle = degrees(1.0);
    for (const Need& need : {Need{Extrinsic::kTime, limits.time, 1e3, "ms"},
                             Need{Extrinsic::kScale, limits.scale, 1e2, "%"},
                             Need{Extrinsic::kLaserYaw, limits.yaw, angle, "deg"},
                             Need{Extrinsic::kLaserX, limits.arm, 1e2, "cm"},
                             Need{Extrinsic::kCameraYaw, limits.yaw, angle, "deg"},
                             Need{Extrinsic::kCameraX, limits.arm, 1e2, "cm"},
                             Need{Extrinsic::kCameraY, limits.arm, 1e2, "cm"}}) {
        const double sigma = result.sigma(need.of);
        if (!(sigma <= need.limit)) {
            result.missing.push_back(fmt::format(
                "{} is known to +-{:.2g} {} only, +-{:.2g} {} are needed", to_string(need.of),
                need.factor * sigma, need.unit, need.factor * need.limit, need.unit));
        }
    }
    if (!result.converged) {
        result.missing.emplace_back("the estimate does not settle");
    }
    if (2 * result.outliers > result.intervals) {
        result.missing.emplace_back("images and scans contradict each other most of the time");
    }
}

void take(const ExtrinsicsSolution& solution, ExtrinsicsResult& result) {
    const auto value = [&](Extrinsic of) { return solution.values[static_cast<int>(of)]; };
    result.camera_time = value(Extrinsic::kTime);
    result.visual_scale = value(Extrinsic::kScale);
    result.robot_from_laser.translation.x() = value(Extrinsic::kLaserX);
    result.robot_from_laser.heading = value(Extrinsic::kLaserYaw);
    result.robot_from_camera = {value(Extrinsic::kCameraX), value(Extrinsic::kCameraY),
                                value(Extrinsic::kCameraYaw)};
    std::copy(solution.sigmas.begin(), solution.sigmas.end(), result.sigmas.begin());
    result.iterations = solution.iterations;
    result.converged = solution.converged;
    result.intervals = solution.intervals;
    result.outliers = solution.outliers;
    result.blind = solution.blind;
    result.rms_translation = solution.residuals.translation;
    result.rms_heading = solution.residuals.heading;
    result.rms_slip = solution.residuals.slip;
}

/// Leaves out steps in which the robot stands; returns how many these were.
std::size_t drop_standing(std::vector<LaserStep>& steps) {
    const auto kept = std::stable_partition(steps.begin(), steps.end(), moves);
    const auto standing = static_cast<std::size_t>(steps.end() - kept);
    steps.erase(kept, steps.end());
    return standing;
}

}  // namespace

std::string_view to_string(Extrinsic extrinsic) {
    switch (extrinsic) {
        case Extrinsic::kTime:
            return "camera time";
        case Extrinsic::kScale:
            return "visual scale";
        case Extrinsic::kLaserYaw:
            return "lidar yaw";
        case Extrinsic::kLaserX:
            return "lidar x";
        case Extrinsic::kCameraYaw:
            return "camera yaw";
        case Extrinsic::kCameraX:
            return "camera x";
        case Extrinsic::kCameraY:
            return "camera y";
    }
    return "unknown";
}

std::optional<double> ExtrinsicsResult::ways_too_long() const {
    constexpr double kMostSigma = 0.05;
    const double deviation = sigma(Extrinsic::kScale);
    if (!fit() || !(visual_scale > 0.0) || !(deviation <= kMostSigma)) {
        return std::nullopt;
    }
    return 1.0 / visual_scale - 1.0;
}

ExtrinsicsResult calibrate_extrinsics(const ExtrinsicsDrive& drive,
                                      const ExtrinsicsConfig& config) {
    check(config);
    ExtrinsicsResult result;
    result.robot_from_laser = drive.robot_from_laser;
    result.robot_from_camera = drive.robot_from_camera;
    std::vector<LaserStep> compared = laser_steps(drive, config.interval, config.max_gap);
    std::vector<LaserStep> slipping = laser_steps(drive, config.slip_interval, config.max_gap);
    result.standing = drop_standing(compared);
    drop_standing(slipping);
    measure_drive(drive, compared, result);
    take(solve_extrinsics(drive, compared, slipping, config), result);
    find_what_is_missing(config, result);
    if (result.fit()) {
        find_vague(config.limits, result);
    }
    return result;
}

}  // namespace hybrid_slam
