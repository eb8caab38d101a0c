// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "halls.hpp"
#include "hybrid_slam/pilot/pilot.hpp"
#include "hybrid_slam/vehicle/clearance.hpp"

namespace hybrid_slam::test {

/// A pilot, the truck that it drives and a SLAM that tells where that is; all of them stepped.
class PilotedTruck {
  public:
    static constexpr double kStep = 0.02;
    static constexpr std::uint64_t kSlam = 1;
    static constexpr std::uint64_t kClient = 2;

    explicit PilotedTruck(const PilotConfig& config = {}, const Pose2d& start = {0.0, 1.6, 0.0})
        : config_(config), field_(thesis_hall()), pilot_(vehicle_, config, "hall") {
        truck_.world_from_robot = start;
    }

    /// Seconds; ends early when `until` says so. Whether it did.
    bool run(double seconds, const std::function<bool()>& until = {}) {
        for (const double end = now_ + seconds; now_ < end - 1e-9;) {
            one_step();
            if (until && until()) {
                return true;
            }
        }
        return false;
    }

    /// Nobody asks the pilot for so long; what came meanwhile it gets at the end.
    void hang(double seconds) {
        now_ += seconds;
        one_step();
    }

    void tell(const decltype(LinkEvent::what)& what, std::uint64_t client = kClient) {
        LinkEvent event;
        event.client = client;
        event.role = client == kSlam ? LinkRole::kPose : LinkRole::kGoal;
        event.arrival = now_;
        event.what = what;
        events_.push_back(event);
    }
    void go_to(const std::vector<Point2>& places, bool append = false) {
        LinkGoals goals;
        for (const Point2& place : places) {
            goals.waypoints.push_back({place, std::nullopt});
        }
        goals.append = append;
        goals.id = "tour";
        tell(goals);
    }

    bool stands() const {
        return truck_.speed == 0.0 && !out.command.value_or(DriveCommand()).speed;
    }
    bool arrived() const { return out.status.state == LinkDriveState::kArrived; }
    double away_from(const Point2& place) const {
        return (truck_.world_from_robot.translation - place).norm();
    }
    const VehicleState& truck() const { return truck_; }
    double now() const { return now_; }
    Pilot& pilot() { return pilot_; }

    PilotOutput out;  ///< of the last step
    std::vector<std::string> refusals;
    bool plans = true;                 ///< routes are found as they are asked for
    bool slam_talks = true;            ///< poses come
    bool has_feedback = true;          ///< the drive tells speed and steering
    bool counts_backwards = false;     ///< its wheels' sensor is the wrong way round
    std::optional<double> told_speed;  ///< m/s, whatever the truck does
    bool obeys = true;                 ///< the truck does what it is told
    int planned = 0;                   ///< routes
    std::string drive_fault;           ///< what the drive says
    /// What SLAM gets wrong, or the network.
    std::function<void(LinkEvent&, LinkPose&)> spoil;

  private:
    void one_step() {
        now_ += kStep;
        ++steps_;
        if (slam_talks && steps_ % 4 == 0) {
            say_pose();
        }
        PilotInput input;
        input.now = now_;
        input.seconds = kStep;
        input.events = std::exchange(events_, {});
        input.drive.fault = drive_fault;
        if (has_feedback) {
            input.drive.speed =
                told_speed.value_or(counts_backwards ? -truck_.speed : truck_.speed);
            input.drive.steering = truck_.steering;
        }
        out = pilot_.step(input);
        for (const auto& refusal : out.refusals) {
            refusals.push_back(refusal.reason);
        }
        const std::optional<RouteRequest> request = pilot_.wanted_route();
        if (plans && request) {
            ++planned;
            pilot_.take(request->number, plan_route(field_, vehicle_, request->start,
                                                    request->waypoints, config_.planner));
        }
        truck_ = !obeys ? truck_
                        : step(vehicle_, truck_,
                               out.command.value_or(DriveCommand{0.0, truck_.steering}), kStep);
    }

    /// Of 80 ms ago, as scan and computing make it.
    void say_pose() {
        past_.push_back(truck_.world_from_robot);
        LinkPose pose;
        pose.stamp = now_ - 0.08;
        pose.age = 0.08;
        pose.map = "hall";
        pose.status = LinkPoseStatus::kTracking;
        pose.map_from_robot = past_.size() > 1 ? past_[past_.size() - 2] : past_.back();
        pose.covariance.diagonal() << 1e-4, 1e-4, 1e-5;
        pose.score = 0.9;
        pose.clear_ahead = 5.0;
        pose.clear_behind = 5.0;
        pose.is_protective = false;
        LinkEvent event;
        event.client = kSlam;
        event.role = LinkRole::kPose;
        event.arrival = now_;
        if (spoil) {
            spoil(event, pose);
        }
        event.what = pose;
        events_.push_back(event);
    }

    VehicleConfig vehicle_;
    PilotConfig config_;
    ClearanceField field_;
    Pilot pilot_;
    VehicleState truck_;
    std::vector<LinkEvent> events_;
    std::vector<Pose2d> past_;
    double now_ = 0.0;
    long steps_ = 0;
};

}  // namespace hybrid_slam::test
