// SPDX-License-Identifier: Apache-2.0
#include "pose_watch.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace hybrid_slam {
namespace {

constexpr double kSourceSilent = 1.0;  ///< seconds, after which another source may take over
constexpr double kWheelMemory = 2.0;   ///< seconds: poses are younger than that
constexpr double kPoseMemory = 5.0;    ///< seconds in which a pose has to have moved along
constexpr double kMoved = 0.4;         ///< share of the wheels' way that a live pose has moved

}  // namespace

void PoseWatch::drive(double now, double metres) {
    odometer_ += metres;
    wheels_.push_back({now, odometer_, Point2(0.0, 0.0), 0.0});
    while (now - wheels_.front().time > kWheelMemory) {
        wheels_.pop_front();
    }
}

double PoseWatch::odometer_at(double time) const {
    const auto later = std::find_if(wheels_.begin(), wheels_.end(),
                                    [&](const Sample& sample) { return sample.time >= time; });
    if (later == wheels_.end()) {
        return odometer_;
    }
    return later->odometer;
}

/// The reason against this source, or none. Another one takes over only when the first is gone or
/// silent.
std::optional<std::string> PoseWatch::choose(const LinkEvent& event) {
    if (event.client == source_) {
        return std::nullopt;
    }
    const auto refuse = [&](const std::string& reason) {
        return turned_away_.insert(event.client).second ? reason : std::string();
    };
    const auto name = names_.find(event.client);
    if (!config_.pose_source.empty() &&
        (name == names_.end() || name->second != config_.pose_source)) {
        return refuse("only the pose source named '" + config_.pose_source + "' is listened to");
    }
    if (source_ != 0 && event.arrival - arrival_ <= kSourceSilent) {
        return refuse("another pose source is listened to");
    }
    source_ = event.client;
    turned_away_.clear();
    poses_.clear();
    news_ = fmt::format("poses are taken from client {}", source_);
    return std::nullopt;
}

double PoseWatch::excess() const {
    return std::max(lateness_, pose_.age - config_.pose_delay);
}

std::optional<std::string> PoseWatch::take(const LinkEvent& event, const LinkPose& pose) {
    if (std::optional<std::string> reason = choose(event)) {
        return reason->empty() ? std::nullopt : reason;
    }
    pose_ = pose;
    any_ = true;
    is_fresh_ = true;
    arrival_ = event.arrival;
    lateness_ = event.lateness;
    if (!is_usable()) {
        poses_.clear();
        frozen_.reset();  // whatever comes next is a new pose
        return std::nullopt;
    }
    look_for_jump();
    if (excess() > config_.pose_valid) {
        poses_.clear();  // nobody knows well when those were taken
    } else {
        compare_with_wheels();
    }
    last_known_ = pose.map_from_robot;
    last_known_arrival_ = event.arrival;
    last_known_age_ = pose.age;
    last_known_odometer_ = odometer_at(taken_at());
    return std::nullopt;
}

/// From where the last pose and the wheels say that the vehicle is. Its way is not longer than the
/// wheels', and a turn needs a way.
void PoseWatch::look_for_jump() {
    if (!last_known_) {
        return;
    }
    constexpr double kTurn = radians(45.0);
    constexpr double kSharpest = 3.1;  // 1/m, sharper than any truck of this kind turns
    const Pose2d step = between(*last_known_, pose_.map_from_robot);
    const double driven = std::abs(odometer_ - last_known_odometer_);
    const bool has_jumped = step.translation.norm() > driven + config_.pose_jump ||
                            std::abs(step.heading) > kTurn + kSharpest * driven;
    if (!has_jumped) {
        return;
    }
    if (!std::exchange(jump_is_wanted_, false) || arrival_ > jump_wanted_until_) {
        jump_ = fmt::format("the pose jumped by {:.2f} m and {:.0f} deg", step.translation.norm(),
                            degrees(std::abs(step.heading)));
    }
    poses_.clear();
    frozen_.reset();
}

/// A pose that stays where it is while the wheels turn is an old one that somebody repeats.
void PoseWatch::compare_with_wheels() {
    const Sample now{taken_at(), odometer_at(taken_at()), pose_.map_from_robot.translation,
                     pose_.map_from_robot.heading};
    // The way along where the vehicle headed then, backwards too: wheels that count the wrong way
    // round do not agree either.
    const auto has_followed = [&](const Sample& then) {
        const Point2 way = now.place - then.place;
        const double along = way.x() * std::cos(then.heading) + way.y() * std::sin(then.heading);
        const double wheels = now.odometer - then.odometer;
        return along * (wheels < 0.0 ? -1.0 : 1.0) >= kMoved * std::abs(wheels);
    };
    if (frozen_) {
        if (has_followed(*frozen_)) {
            frozen_.reset();
            poses_.clear();
        }
    } else {
        const auto then = std::find_if(poses_.rbegin(), poses_.rend(), [&](const Sample& sample) {
            return std::abs(now.odometer - sample.odometer) >= config_.frozen_after;
        });
        if (then != poses_.rend() && !has_followed(*then)) {
            frozen_ = *then;
        }
    }
    poses_.push_back(now);
    while (now.time - poses_.front().time > kPoseMemory) {
        poses_.pop_front();
    }
}

void PoseWatch::gone(std::uint64_t client) {
    turned_away_.erase(client);
    names_.erase(client);
    if (client == source_) {
        source_ = 0;
    }
}

bool PoseWatch::is_of_this_map() const {
    return map_.empty() || pose_.map.empty() || pose_.map == map_;
}

bool PoseWatch::is_uncertain() const {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> position(
        pose_.covariance.topLeftCorner<2, 2>(), Eigen::EigenvaluesOnly);
    // Put so that what is no number is uncertain.
    const double most = config_.position_sigma * config_.position_sigma;
    return !(position.eigenvalues()(1) <= most) ||
           !(pose_.covariance(2, 2) <= config_.heading_sigma * config_.heading_sigma);
}

std::string PoseWatch::objection(double now) const {
    if (!any_) {
        return "no pose has come yet";
    }
    if (!(now - arrival_ + std::max(0.0, excess()) <= config_.pose_valid)) {
        return source_ == 0 ? "the pose source is gone" : "no fresh pose";
    }
    if (!is_of_this_map()) {
        return fmt::format("the poses are in another map: {}, not {}", pose_.map, map_);
    }
    if (!pose_.is_known()) {
        return pose_.status == LinkPoseStatus::kLost ? "localization is lost"
                                                     : "localization searches for its place";
    }
    if (is_uncertain()) {
        return "the pose is too uncertain";
    }
    if (frozen_) {
        return "the pose does not follow the wheels";
    }
    return pose_.is_protective ? "something is in the protective field" : "";
}

std::optional<PoseReading> PoseWatch::fresh(double now) {
    if (!is_fresh_ || !is_usable()) {
        return std::nullopt;
    }
    is_fresh_ = false;
    return PoseReading{pose_.map_from_robot, now - taken_at()};
}

double PoseWatch::free_way(const std::optional<double>& told) const {
    if (!told || !any_) {
        return 0.0;
    }
    // What was free when the scan was taken has been driven into since.
    return std::max(0.0, *told - std::abs(odometer_ - odometer_at(taken_at())));
}

}  // namespace hybrid_slam
