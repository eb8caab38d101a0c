// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <set>
#include <string>

#include "hybrid_slam/pilot/pilot.hpp"

namespace hybrid_slam {

/// The poses that come in, and whether they may be driven on. One source is listened to at a time.
class PoseWatch {
  public:
    PoseWatch(const PilotConfig& config, std::string map) : config_(config), map_(std::move(map)) {}

    /// What the wheels have driven since the last call; negative is backwards.
    void drive(double now, double metres);
    /// The reason when the pose is not listened to, told once to each client.
    std::optional<std::string> take(const LinkEvent& event, const LinkPose& pose);
    void gone(std::uint64_t client);

    /// Why no pose may be driven on now; empty when one may.
    std::string objection(double now) const;
    /// The pose that came since the last call, if it is a known one.
    std::optional<PoseReading> fresh(double now);
    /// The newest that was known.
    const std::optional<Pose2d>& last_known() const { return last_known_; }
    double newest_stamp() const { return pose_.stamp; }
    /// Seconds since that came.
    double age(double now) const { return now - last_known_arrival_; }
    /// Metres that are free now in the corridor of the newest pose; 0 when nobody says so.
    double free_ahead(double now) const { return free_way(pose_.clear_ahead, now); }
    double free_behind(double now) const { return free_way(pose_.clear_behind, now); }

  private:
    struct Sample {
        double time = 0.0;
        double odometer = 0.0;  ///< metres, backwards counts back
        Point2 place{0.0, 0.0};
    };

    double free_way(const std::optional<double>& told, double now) const;
    double odometer_at(double time) const;
    bool is_of_this_map() const;
    bool is_usable() const { return pose_.is_known() && is_of_this_map(); }
    bool is_uncertain() const;
    void compare_with_wheels(double taken_at);

    PilotConfig config_;
    std::string map_;
    std::uint64_t source_ = 0;  ///< 0: none
    std::set<std::uint64_t> turned_away_;
    LinkPose pose_;  ///< the newest
    bool any_ = false;
    bool is_fresh_ = false;
    double arrival_ = 0.0;
    double lateness_ = 0.0;
    std::optional<Pose2d> last_known_;
    double last_known_arrival_ = 0.0;

    double odometer_ = 0.0;
    std::deque<Sample> wheels_;     ///< of the last second or so; without places
    std::deque<Sample> poses_;      ///< of the last seconds
    std::optional<Sample> frozen_;  ///< the pose has not left this place though the wheels did
};

}  // namespace hybrid_slam
