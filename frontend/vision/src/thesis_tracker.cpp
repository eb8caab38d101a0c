// SPDX-License-Identifier: Apache-2.0
#include "thesis_tracker.hpp"

#include <algorithm>
#include <cmath>

namespace hybrid_slam {
namespace {

constexpr std::size_t kLeast = 4;  ///< features of a region
constexpr int kLevels = 3;

}  // namespace

ThesisTracker::ThesisTracker(const CameraOnRobot& camera, const VisualOdometryConfig& config)
    : camera_(camera), config_(config) {
    // From the plane z = 1 of the camera to the floor below it, axes as the robot's: c + d / rho
    // with rho = -d.z / c.z.
    const Eigen::Matrix3d turn = camera.robot_from_camera();
    const double height = camera.center().z();
    floor_from_image_.row(0) = height * turn.row(0);
    floor_from_image_.row(1) = height * turn.row(1);
    floor_from_image_.row(2) = -turn.row(2);
}

VisualMotion ThesisTracker::track(const Image& image) {
    VisualMotion motion;
    motion.from_stamp = stamp_.value_or(image.stamp);
    motion.stamp = image.stamp;
    stamp_ = image.stamp;
    features_.clear();
    Pyramid now = make_pyramid(gray_of(image), 1.0, image.stamp);
    if (!before_.empty()) {
        const Flow flow = follow(before_, now, history_, history_, kLevels);
        ImagePoints followed;
        for (std::size_t i = 0; i < history_.size(); ++i) {
            if (flow.good[i] && flow.miss[i].dot(flow.miss[i]) < 1.0F) {
                const double line = config_.thesis_line * camera_.model().height;
                const Pixel before(history_[i].x, history_[i].y);
                features_.push_back(
                    {before, {flow.now[i].x, flow.now[i].y}, before.y() > line, true});
                followed.push_back(flow.now[i]);
            }
        }
        history_ = followed;
        motion.status = measure(motion);
    }
    if (history_.size() < static_cast<std::size_t>(config_.features) / 2) {
        history_ = find_corners(now, {}, static_cast<std::size_t>(config_.features));
    }
    before_ = std::move(now);
    return motion;
}

void ThesisTracker::restart() {
    before_ = Pyramid();
    history_.clear();
    features_.clear();
    stamp_.reset();
}

VisualStatus ThesisTracker::measure(VisualMotion& motion) {
    double heading_variance = 0.0;
    std::size_t sky = 0;
    const double heading = heading_change(heading_variance, sky);
    if (sky < kLeast) {
        return VisualStatus::kTooFewFeatures;
    }
    const Mean shift = translation(heading);
    if (shift.count < kLeast) {
        return VisualStatus::kTooFewFeatures;
    }
    motion.before_from_now = Pose2d(shift.value, heading);
    motion.covariance =
        Eigen::Vector3d(shift.variance, shift.variance, heading_variance).asDiagonal();
    return VisualStatus::kGood;
}

/// Equations 3.1 and 3.2: features that move to the right tell of a turn to the left.
double ThesisTracker::heading_change(double& variance, std::size_t& count) const {
    double sum = 0.0;
    double squares = 0.0;
    count = 0;
    for (const auto& feature : features_) {
        const auto before = camera_.model().ray(feature.before);
        const auto now = camera_.model().ray(feature.now);
        if (feature.floor || !before || !now) {
            continue;
        }
        const double change = std::atan(now->x()) - std::atan(before->x());
        sum += change;
        squares += change * change;
        ++count;
    }
    const double mean = sum / static_cast<double>(std::max<std::size_t>(count, 1));
    const double spread =
        squares / static_cast<double>(std::max<std::size_t>(count, 1)) - mean * mean;
    variance = std::max(spread, 1e-8) / static_cast<double>(std::max<std::size_t>(count, 1));
    return mean;
}

/// Equations 3.3 to 3.5 of section 3.4.2: ground features turned back by the change of heading.
ThesisTracker::Mean ThesisTracker::translation(double heading_change) const {
    Mean mean;
    double squares = 0.0;
    const Pose2d turn(0.0, 0.0, heading_change);
    for (const auto& feature : features_) {
        const auto before = feature.floor ? on_floor(feature.before) : std::nullopt;
        const auto now = feature.floor ? on_floor(feature.now) : std::nullopt;
        if (!before || !now) {
            continue;
        }
        const Eigen::Vector2d shift = *before - turn * *now;
        mean.value += shift;
        squares += shift.squaredNorm();
        ++mean.count;
    }
    const auto count = static_cast<double>(std::max<std::size_t>(mean.count, 1));
    mean.value /= count;
    mean.variance = std::max(0.5 * (squares / count - mean.value.squaredNorm()), 1e-8) / count;
    return mean;
}

/// Equation 3.3 of the homography, applied.
std::optional<Eigen::Vector2d> ThesisTracker::on_floor(const Pixel& pixel) const {
    const auto ray = camera_.model().ray(pixel);
    if (!ray) {
        return std::nullopt;
    }
    const Eigen::Vector3d point = floor_from_image_ * *ray;
    if (point.z() < 1e-3) {
        return std::nullopt;  // at the horizon or above
    }
    return Eigen::Vector2d(point.head<2>() / point.z());
}

}  // namespace hybrid_slam
