// SPDX-License-Identifier: Apache-2.0
#include "floor_border.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hybrid_slam {
namespace {

constexpr std::size_t kBins = 720;  ///< half a degree each
constexpr double kBinAngle = 2.0 * kPi / kBins;
constexpr double kNearest = 0.05;  ///< metres; what is nearer to the camera is no nearer than this
constexpr float kNothing = std::numeric_limits<float>::infinity();
constexpr std::size_t kNeighbors = 3;  ///< beams to each side
constexpr double kOneSurface = 0.3;    ///< metres between neighbouring beams on one surface

std::size_t bin_of(double angle) {
    const double share = (normalize_angle(angle) + kPi) / (2.0 * kPi);
    return std::min(static_cast<std::size_t>(share * kBins), kBins - 1);
}

/// The mean over neighbouring beams on one surface: single ranges are noisy.
double smooth_range(const Scan& scan, std::size_t beam) {
    const float middle = scan.ranges[beam];
    if (beam < kNeighbors || beam + kNeighbors >= scan.ranges.size()) {
        return middle;
    }
    double sum = 0.0;
    for (std::size_t i = beam - kNeighbors; i <= beam + kNeighbors; ++i) {
        if (!scan.is_return(scan.ranges[i]) || std::abs(scan.ranges[i] - middle) > kOneSurface) {
            return middle;
        }
        sum += scan.ranges[i];
    }
    return sum / (2.0 * kNeighbors + 1.0);
}

}  // namespace

FloorBorder::FloorBorder(const Scan& scan, const Pose2d& image_from_scan,
                         const Eigen::Vector2d& camera)
    : nearest_(kBins, kNothing) {
    const auto mark = [this, &camera](const Eigen::Vector2d& point) {
        const Eigen::Vector2d away = point - camera;
        float& nearest = nearest_[bin_of(std::atan2(away.y(), away.x()))];
        nearest = std::min(nearest, static_cast<float>(away.norm()));
    };
    const Pose2d image_from_laser = image_from_scan * scan.robot_from_laser;
    Eigen::Vector2d before = Eigen::Vector2d::Zero();
    bool follows = false;
    for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
        if (!scan.is_return(scan.ranges[i])) {
            follows = false;
            continue;
        }
        const double angle = scan.angle(i);
        const double range = smooth_range(scan, i);
        const Eigen::Vector2d point =
            image_from_laser * Eigen::Vector2d(range * std::cos(angle), range * std::sin(angle));
        mark(point);
        // Seen from the camera, neighbouring beams may leave bins between them.
        if (follows && (point - before).norm() < kOneSurface) {
            const double nearest =
                std::max(std::min((point - camera).norm(), (before - camera).norm()), kNearest);
            const int steps = 2 + static_cast<int>((point - before).norm() / (nearest * kBinAngle));
            for (int k = 1; k < steps; ++k) {
                mark(before + static_cast<double>(k) / steps * (point - before));
            }
        }
        before = point;
        follows = true;
    }
}

std::optional<double> FloorBorder::distance(const Eigen::Vector3d& direction) const {
    const float nearest = nearest_[bin_of(std::atan2(direction.y(), direction.x()))];
    return nearest < kNothing ? std::optional<double>(nearest) : std::nullopt;
}

}  // namespace hybrid_slam
