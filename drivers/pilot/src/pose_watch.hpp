// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "hybrid_slam/pilot/pilot.hpp"

namespace hybrid_slam {

/// The poses that come in, and whether they may be driven on. One source is listened to at a time.
class PoseWatch {
  public:
    PoseWatch(const PilotConfig& config, std::string map) : config_(config), map_(std::move(map)) {}

    /// What the wheels have driven since the last call; negative is backwards.
    void drive(double now, double metres);
    void connected(std::uint64_t client, const std::string& name) { names_[client] = name; }
    /// The reason when the pose is not listened to, told once to each client.
    std::optional<std::string> take(const LinkEvent& event, const LinkPose& pose);
    void gone(std::uint64_t client);
    /// The next jump is wanted: somebody has said where the vehicle stands.
    void expect_jump(double until) {
        jump_is_wanted_ = true;
        jump_wanted_until_ = until;
    }
    void expect_no_jump() { jump_is_wanted_ = false; }
    /// What a pose jumped by since the last call, in words; empty when none did.
    std::string jump() { return std::exchange(jump_, {}); }
    /// Whose poses are listened to, when that has changed since the last call.
    std::string news() { return std::exchange(news_, {}); }
    bool has_source() const { return source_ != 0; }
    const LinkPose* newest() const { return any_ ? &pose_ : nullptr; }

    /// Why no pose may be driven on now; empty when one may.
    std::string objection(double now) const;
    /// The pose that came since the last call, if it is a known one.
    std::optional<PoseReading> fresh(double now);
    /// The newest that was known.
    const std::optional<Pose2d>& last_known() const { return last_known_; }
    double newest_stamp() const { return pose_.stamp; }
    /// Seconds since the scan of that.
    double age(double now) const { return now - last_known_arrival_ + last_known_age_; }
    /// Metres that are free now in the corridor of the newest pose; 0 when nobody says so.
    double free_ahead() const { return free_way(pose_.clear_ahead); }
    double free_behind() const { return free_way(pose_.clear_behind); }

  private:
    struct Sample {
        double time = 0.0;
        double odometer = 0.0;  ///< metres, backwards counts back
        Point2 place{0.0, 0.0};
        double heading = 0.0;
    };

    double free_way(const std::optional<double>& told) const;
    double odometer_at(double time) const;
    bool is_of_this_map() const;
    bool is_usable() const { return pose_.is_known() && is_of_this_map(); }
    bool is_uncertain() const;
    std::optional<std::string> choose(const LinkEvent& event);
    /// Seconds by which the pose is older than it looks.
    double excess() const;
    void look_for_jump();
    void compare_with_wheels();
    /// When the scan of the newest pose was taken, by the clock of its arrival.
    double taken_at() const { return arrival_ - pose_.age - lateness_; }

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
    double last_known_age_ = 0.0;
    double last_known_odometer_ = 0.0;
    bool jump_is_wanted_ = false;
    double jump_wanted_until_ = 0.0;  ///< seconds
    std::string jump_;
    std::string news_;
    std::map<std::uint64_t, std::string> names_;

    double odometer_ = 0.0;
    std::deque<Sample> wheels_;     ///< of the last second or so; without places
    std::deque<Sample> poses_;      ///< of the last seconds
    std::optional<Sample> frozen_;  ///< the pose has not left this place though the wheels did
};

}  // namespace hybrid_slam
